#include "bench/hidden/marks.h"

#include <fmt/format.h>

#include "bench/result.h"

namespace imrig::bench {
namespace {

constexpr double kSeen = 10.0;                          // sqrt lambda from which an effect must be named
constexpr double kOutside = 20.0, kOutsideSure = 40.0;  // the same of what the library lacks

void print(const char* name, const Share& s, double target, bool higher, const std::string& note, bool json) {
  if (s.of == 0) return;
  bench::print({name, 100.0 * s.value(), "%", target, higher,
                fmt::format("{} of {}, 95 %: {:.0f} to {:.0f}{}{}", s.good, s.of, 100.0 * s.low(), 100.0 * s.high(),
                            s.of < 30 ? ", too few runs" : "", note.empty() ? "" : "; " + note)},
               json);
}

std::string listed(const std::map<std::string, int>& times) {
  std::string out;
  for (const auto& [what, n] : times) out += fmt::format("{}{} x {}", out.empty() ? "" : ", ", n, what);
  return out.empty() ? "none" : out;
}

// Without a word: an effect with the equation of what is hidden says that it cannot tell them apart.
bool blamed(const Outcome& o) {
  if (o.named.empty() || o.verdict == "unknown" || o.doubted) return false;
  for (const std::string& hidden : o.seal.hidden) {
    if (kind(hidden).alike == o.named) return false;
  }
  return true;
}

}  // namespace

void Marks::count(const Outcome& o) {
  if (!cell(o.seal.cell).other_machine.empty()) return refused_.count(!o.failed.empty() || !blamed(o));
  spoke_.count(o.failed.empty());
  if (!o.failed.empty()) return;
  if (o.seal.outside) return count_outside(o);
  if (o.false_accepted > 0) ++false_[o.seal.cell];
  const int accepted = static_cast<int>(o.accepted.size());
  false_of_accepted_.add(o.false_accepted, accepted);
  covered_.add(o.covered, o.intervals);
  if (o.seal.truth.empty()) {
    nothing_at_floor_.count(o.at_floor());
    return false_claim_.count(!o.named.empty());
  }
  if (o.seal.truth.size() > 2) return triples_exact_.count(o.exact());
  unknown_.count(o.verdict == "unknown");
  if (o.follow) count_followed(*o.follow);
  if (o.sqrt_lambda >= kSeen) count_seen(o);
}

void Marks::count_outside(const Outcome& o) {
  if (o.excess >= kOutsideSure) blamed_surely_.count(blamed(o));
  if (o.excess >= kOutside) blamed_.count(blamed(o));
  if (o.excess >= kOutside && blamed(o)) ++missed_[fmt::format("{} as {}", o.seal.cell, o.named)];
}

void Marks::count_followed(const FollowUp& f) {
  if (f.reference) {
    ++references_;
    return;
  }
  raised_.count(f.raised());
  settled_.count(f.settled);
}

void Marks::count_seen(const Outcome& o) {
  if (!o.set_holds_truth()) ++missed_[fmt::format("{} as {}", o.seal.cell, o.named.empty() ? o.verdict : o.named)];
  if (o.seal.truth.size() > 1) exact_.count(o.exact());
  if (!(o.d < 3.0)) first_.count(o.named_first());
  in_set_.count(o.set_holds_truth());
  set_sizes_ += static_cast<double>(o.confusable.size());
  excess_.count(o.excess_removed() >= 0.98);
  at_floor_.count(o.at_floor());
  at_chance_.count(o.at_chance());
}

void Marks::print_all(bool json) const {
  const double mean_size = in_set_.of > 0 ? set_sizes_ / in_set_.of : 0.0;
  print("hidden_spoke", spoke_, 100.0, true, "data sets that diagnosis could read", json);
  print("hidden_false_claim", false_claim_, 1.0, false, "nothing hidden, something named", json);
  print("hidden_first", first_, 98.0, true, "named first, sqrt lambda >= 10 and d >= 3 or no rival", json);
  print("hidden_in_set", in_set_, 98.0, true,
        fmt::format("set holds the truth, sqrt lambda >= 10; mean size {:.2f}", mean_size), json);
  print("hidden_false_accepted", false_of_accepted_, 2.0, false,
        fmt::format("of accepted effects, neither hidden nor confusable with it; {}", listed(false_)), json);
  print("hidden_pairs_exact", exact_, 95.0, true, "", json);
  print("hidden_triples_exact", triples_exact_, 95.0, true, "no mark asks for it", json);
  print("hidden_excess", excess_, 98.0, true, "runs where 98 % of the excess chi2 went", json);
  print("hidden_at_floor", at_floor_, 95.0, true, "hold-out nrmse at most 1.05 x floor", json);
  print("hidden_at_chance", at_chance_, 95.0, true,
        "or at most 1.05 x what the same noise leaves where nothing is hidden", json);
  print("hidden_floor_itself", nothing_at_floor_, 95.0, true, "the same where nothing is hidden: what chance leaves", json);
  print("hidden_covered", covered_, 95.0, true, "95 % intervals of R_s, R_r, L_l, L_m hold the machine's; 93 to 97 asked", json);
  print("hidden_wrong_blame_20", blamed_, 10.0, false,
        fmt::format("not in the library, excess over 20 sigma, blamed without a word; missed or blamed: {}", listed(missed_)),
        json);
  print("hidden_wrong_blame_40", blamed_surely_, 1.0, false, "the same over 40 sigma", json);
  print("hidden_refused", refused_, 98.0, true, "no induction motor, nothing blamed without a word", json);
  print("hidden_next_raises", raised_, 95.0, true,
        fmt::format("the experiment named raises the true d; {} runs beside were told that no record helps", references_),
        json);
  print("hidden_next_settles", settled_, 85.0, true, "and settles it", json);
  print("hidden_unknown", unknown_, 3.0, false, "in the library, called unknown", json);
}

}  // namespace imrig::bench
