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

#include "bench/hidden/marks.h"
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
  if (cell(o.seal.cell).drawn > 0) fmt::print(stderr, "({}) ", joined(o.seal.truth));
  fmt::print(stderr,
             "{} {} [{}]; set {}; accepted {}; truth: sqrt lambda {:.1f}, d {:.2f}; chi2 {:.3f} -> {:.3f}; "
             "hold-out/floor "
             "{:.3f} -> {:.3f}; {:.1f} s\n",
             o.verdict, o.named.empty() ? "none" : o.named, o.estimate, joined(o.confusable),
             joined(o.accepted), o.sqrt_lambda, o.d, o.chi2_before, o.chi2_after, o.base_holdout_over_floor,
             o.holdout_over_floor, o.seconds);
  if (o.nothing_over_floor)
    fmt::print(stderr, "  nothing hidden, same noise: hold-out/floor {:.3f}\n", *o.nothing_over_floor);
}

void tell(const FollowUp& f) {
  if (f.what.empty() || f.reference) {
    fmt::print(stderr, "  next: {}; d {:.2f}\n", f.what.empty() ? "nothing" : f.what, f.before);
    return;
  }
  fmt::print(stderr, "  next: {}; d {:.2f} -> {:.2f} (forecast {:.2f}), {}\n", f.what, f.before, f.after,
             f.forecast, f.settled ? "settled" : "not settled");
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

// The cell with nothing hidden whose sensors are the same.
const Cell& without(const Cell& hidden) {
  const auto any = [&](bool Kind::*what) {
    return std::any_of(hidden.hidden.begin(), hidden.hidden.end(),
                       [&](const auto& name) { return kind(name).*what; });
  };
  return cell(any(&Kind::commanded) ? "nothing_commanded"
              : any(&Kind::torque)  ? "nothing_torque"
                                    : "nothing");
}

int body(int argc, char** argv) {
  const Options options = parse(argc, argv);
  Marks marks;
  std::uint64_t seed = options.first;  // every run its own machine
  for (int run = 0; run < options.runs; ++run) {
    for (const Job& job : options.jobs) {
      Outcome outcome = score(make_sealed(*job.cell, job.strength, seed, options.seal), 2,
                              options.follow ? &options.seal : nullptr);
      if (outcome.failed.empty() && !outcome.seal.outside && !outcome.seal.truth.empty() &&
          !outcome.at_floor())
        outcome.nothing_over_floor =
            score(make_sealed(without(*job.cell), job.strength, seed, options.seal)).holdout_over_floor;
      ++seed;
      tell(outcome);
      if (outcome.follow) tell(*outcome.follow);
      marks.count(outcome);
    }
  }
  marks.print_all(options.json);
  return 0;
}

}  // namespace
}  // namespace imrig::bench

int main(int argc, char** argv) {
  return imrig::run_main("imrig-bench-hidden", imrig::bench::body, argc, argv);
}
