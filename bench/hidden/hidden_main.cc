// The hidden-effect suite: sealed data sets from the plant, diagnosed blind, then the seals opened.
// usage: imrig-bench-hidden [--json] [--runs N] [--final] [--thin N] [--cell NAME[:weak|medium|strong]]...
//   --runs N   data sets a cell, default 1       --final   seeds from 1001 on instead of tuning seeds from 1
//   on
//   --seed N   the first seed                    --thin N  of samples of 60 us, default 4
//   --poor     data of a constant volts per hertz grid alone
//   --follow   where diagnosis ends ambiguous: take the experiment it names, and diagnose again
// One line a run goes to stderr.

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bench/hidden/score.h"
#include "bench/result.h"
#include "rig/base/error.h"

namespace imrig::bench {
namespace {

struct Job {
  const Cell* cell;
  Strength strength;
};

struct Options {
  bool json = false, follow = false;
  int runs = 1;
  std::uint64_t first = 1;
  SealOptions seal;
  std::vector<Job> jobs;
};

std::string joined(const std::vector<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ","));
}

void tell(const Outcome& o) {
  fmt::print(stderr, "{} {} seed {} ({:.1f} kW, {}): ", o.seal.cell, word(o.seal.strength), o.seal.seed,
             1e-3 * o.seal.machine.power_W, o.base_from);
  if (!o.failed.empty()) {
    fmt::print(stderr, "FAILED {}\n", o.failed);
    return;
  }
  fmt::print(stderr,
             "{} {} [{}]; set {}; accepted {}; truth: sqrt lambda {:.1f}, d {:.2f}; chi2 {:.3f} -> {:.3f}; "
             "hold-out/floor "
             "{:.3f} -> {:.3f}; {:.1f} s\n",
             o.verdict, o.named.empty() ? "none" : o.named, o.estimate, joined(o.confusable),
             joined(o.accepted), o.sqrt_lambda, o.d, o.chi2_before, o.chi2_after, o.base_holdout_over_floor,
             o.holdout_over_floor, o.seconds);
}

void tell(const FollowUp& f) {
  if (f.what.empty() || f.reference) {
    fmt::print(stderr, "  next: {}; d {:.2f}\n", f.what.empty() ? "nothing" : f.what, f.before);
    return;
  }
  fmt::print(stderr, "  next: {}; d {:.2f} -> {:.2f} (forecast {:.2f}), {}\n", f.what, f.before, f.after,
             f.forecast, f.settled ? "settled" : "not settled");
}

// Marks of the whole suite.
struct Marks {
  Share false_claim, first, in_set, wrong_blame, unknown, exact, excess, at_floor, spoke, raised, settled;
  int references = 0;
  double set_sizes = 0.0;
  std::map<std::string, int> missed;

  void count(const Outcome& o) {
    spoke.count(o.failed.empty());
    if (!o.failed.empty()) return;
    if (o.seal.outside) return wrong_blame.count(!o.named.empty() && o.verdict != "unknown");
    if (o.seal.truth.empty()) return false_claim.count(!o.named.empty());
    unknown.count(o.verdict == "unknown");
    if (o.follow) count_followed(*o.follow);
    if (o.sqrt_lambda >= 10.0) count_seen(o);
  }

  void count_followed(const FollowUp& f) {
    if (f.reference) {
      ++references;
      return;
    }
    raised.count(f.raised());
    settled.count(f.settled);
  }

  void count_seen(const Outcome& o) {
    if (!o.set_holds_truth())
      ++missed[fmt::format("{} as {}", o.seal.cell, o.named.empty() ? o.verdict : o.named)];
    if (o.seal.truth.size() > 1) exact.count(o.exact());
    if (!(o.d < 3.0)) first.count(o.named_first());
    in_set.count(o.set_holds_truth());
    set_sizes += static_cast<double>(o.confusable.size());
    excess.count(o.excess_removed() >= 0.98);
    at_floor.count(o.holdout_over_floor <= 1.05);
  }
};

Result of(const std::string& name, const Share& s, double target, bool higher, const std::string& note) {
  return {name,
          100.0 * s.value(),
          "%",
          target,
          higher,
          fmt::format("{} of {}, 95 %: {:.0f} to {:.0f}{}{}", s.good, s.of, 100.0 * s.low(), 100.0 * s.high(),
                      s.of < 30 ? ", too few runs" : "", note.empty() ? "" : "; " + note)};
}

void print_all(const Marks& m, bool json) {
  const auto print_share = [&](const Result& result, const Share& share) {
    if (share.of > 0) print(result, json);
  };
  std::string missed;
  for (const auto& [what, times] : m.missed)
    missed += fmt::format("{}{} x {}", missed.empty() ? "" : ", ", times, what);
  print_share(of("hidden_spoke", m.spoke, 100.0, true, "data sets that diagnosis could read"), m.spoke);
  print_share(of("hidden_false_claim", m.false_claim, 1.0, false, "nothing hidden, something named"),
              m.false_claim);
  print_share(
      of("hidden_first", m.first, 98.0, true, "named first, sqrt lambda >= 10 and d >= 3 or no rival"),
      m.first);
  print_share(of("hidden_in_set", m.in_set, 98.0, true,
                 fmt::format("set holds the truth, sqrt lambda >= 10; mean size {:.2f}; {}",
                             m.in_set.of > 0 ? m.set_sizes / m.in_set.of : 0.0,
                             missed.empty() ? "none missed" : missed)),
              m.in_set);
  print_share(of("hidden_pairs_exact", m.exact, 95.0, true, ""), m.exact);
  print_share(of("hidden_excess", m.excess, 98.0, true, "runs where 98 % of the excess chi2 went"), m.excess);
  print_share(of("hidden_at_floor", m.at_floor, 95.0, true, "hold-out nrmse at most 1.05 x floor"),
              m.at_floor);
  print_share(
      of("hidden_wrong_blame", m.wrong_blame, 10.0, false, "not in the library, blamed without a word"),
      m.wrong_blame);
  const std::string told = fmt::format("{} runs beside were told that no record helps", m.references);
  print_share(
      of("hidden_next_raises", m.raised, 95.0, true, "the experiment named raises the true d; " + told),
      m.raised);
  print_share(of("hidden_next_settles", m.settled, 85.0, true, "and settles it"), m.settled);
  print_share(of("hidden_unknown", m.unknown, 3.0, false, "in the library, called unknown"), m.unknown);
}

Strength strength_of(const std::string& text) {
  for (const Strength s : {Strength::kWeak, Strength::kMedium, Strength::kStrong}) {
    if (text == word(s)) return s;
  }
  throw Error("usage", "no strength is called " + text, "weak, medium or strong");
}

Job job_of(const std::string& text) {
  const auto colon = text.find(':');
  return {&cell(text.substr(0, colon)),
          colon == std::string::npos ? Strength::kMedium : strength_of(text.substr(colon + 1))};
}

Options parse(int argc, char** argv) {
  Options o;
  const auto number = [&](int& k) {
    if (++k >= argc) throw Error("usage", std::string(argv[k - 1]) + " wants a number");
    const long value = std::strtol(argv[k], nullptr, 10);
    if (value < 1 || value > 1000000) throw Error("usage", std::string(argv[k]) + " is no number from 1 on");
    return static_cast<int>(value);
  };
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--json")
      o.json = true;
    else if (word == "--poor")
      o.seal.poor = true;
    else if (word == "--follow")
      o.follow = true;
    else if (word == "--final")
      o.first = 1001;
    else if (word == "--runs")
      o.runs = number(k);
    else if (word == "--seed")
      o.first = static_cast<std::uint64_t>(number(k));
    else if (word == "--thin")
      o.seal.thin = std::min(number(k), 10);
    else if (word == "--cell" && k + 1 < argc)
      o.jobs.push_back(job_of(argv[++k]));
    else
      throw Error("usage", "unknown word " + word);
  }
  if (o.jobs.empty()) {
    for (const Cell& c : cells()) o.jobs.push_back({&c, Strength::kMedium});
  }
  return o;
}

int body(int argc, char** argv) {
  const Options options = parse(argc, argv);
  Marks marks;
  std::uint64_t seed = options.first;  // every run its own machine
  for (int run = 0; run < options.runs; ++run) {
    for (const Job& job : options.jobs) {
      const Outcome outcome = score(make_sealed(*job.cell, job.strength, seed++, options.seal), 2,
                                    options.follow ? &options.seal : nullptr);
      tell(outcome);
      if (outcome.follow) tell(*outcome.follow);
      marks.count(outcome);
    }
  }
  print_all(marks, options.json);
  return 0;
}

}  // namespace
}  // namespace imrig::bench

int main(int argc, char** argv) {
  return imrig::run_main("imrig-bench-hidden", imrig::bench::body, argc, argv);
}
