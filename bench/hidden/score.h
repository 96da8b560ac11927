#pragma once
// What diagnosis made of a sealed data set, compared with the seal after it has spoken.

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
  bool doubted = false;  // it was said that something remains, or that records held out are off
  std::vector<std::string> confusable, accepted;
  double sqrt_lambda = 0.0, d = 0.0;           // of what was hidden, in the first step; d NaN: no rival
  double chi2_before = 0.0, chi2_after = 0.0;  // a fitted value
  double excess = 0.0;                         // sqrt of the chi2 above what noise leaves, before
  double holdout_over_floor = 0.0, base_holdout_over_floor = 0.0;
  // Of the same machine and noise with nothing hidden, where the former lies above 1.05: what chance made of
  // it.
  std::optional<double> nothing_over_floor;
  int false_accepted = 0;          // neither hidden nor told to be confusable with what was
  int covered = 0, intervals = 0;  // 95 % intervals of R_s, R_r, L_l, L_m, where the model can be the plant
  double seconds = 0.0;
  std::optional<FollowUp> follow;  // of an ambiguous run with the truth and a rival in the set

  bool holds(const std::string& effect) const;  // the truth holds it
  bool named_first() const { return holds(named); }
  bool set_holds_truth() const;
  bool set_holds_rival() const;
  bool at_floor() const;          // hold-out nrmse at most 1.05 x floor
  bool at_chance() const;         // or as high with nothing hidden
  bool exact() const;             // accepted is what was hidden
  double excess_removed() const;  // share; 1 where there was none
};

// follow: the options the seal was made with, where the next experiment is to be taken too.
Outcome score(const Sealed& sealed, int threads = 2, const SealOptions* follow = nullptr);

}  // namespace imrig::bench
