#pragma once
// What diagnosis made of a sealed data set, compared with the seal after it has spoken; and shares of runs
// with the interval that so many runs allow.

#include <optional>
#include <string>
#include <vector>

#include "bench/hidden/follow.h"
#include "bench/hidden/sealed.h"

namespace imrig::bench {

struct Outcome {
  Seal seal;
  std::string failed;     // what was thrown; empty: diagnosis spoke
  std::string base_from;  // "identified" or "rough"
  std::string verdict, named;
  std::string estimate;  // of what was named
  std::vector<std::string> confusable, accepted;
  double sqrt_lambda = 0.0, d = 0.0;           // of what was hidden, in the first step; d NaN: no rival
  double chi2_before = 0.0, chi2_after = 0.0;  // a fitted value
  double holdout_over_floor = 0.0, base_holdout_over_floor = 0.0;
  double seconds = 0.0;
  std::optional<FollowUp> follow;  // of an ambiguous run with the truth and a rival in the set

  bool holds(const std::string& effect) const;  // the truth holds it
  bool named_first() const { return holds(named); }
  bool set_holds_truth() const;
  bool set_holds_rival() const;
  bool exact() const;             // accepted is what was hidden
  double excess_removed() const;  // share; 1 where there was none
};

// follow: the options the seal was made with, where the next experiment is to be taken too.
Outcome score(const Sealed& sealed, int threads = 2, const SealOptions* follow = nullptr);

struct Share {
  int good = 0, of = 0;
  void count(bool yes) { good += yes ? 1 : 0, ++of; }
  double value() const { return of > 0 ? static_cast<double>(good) / of : 0.0; }
  // Wilson's 95 % interval (Wilson 1927, J. Am. Stat. Assoc. 22).
  double low() const;
  double high() const;
};

}  // namespace imrig::bench
