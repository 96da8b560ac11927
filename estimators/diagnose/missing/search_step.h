#pragma once
// One step of the search: rank every effect that is not in the model, refit the best of them, decide.
//
// An effect is claimed when its refit settles inside its bounds, its amplitude stands kSure standard errors
// (from record to record) off neutral and is large enough to matter, and the records left out are predicted
// better; a loss at the shaft also by what it wins in the torque. Claims are compared on records left out;
// those that these data cannot tell from the best make one confusable set.

#include <functional>
#include <string>
#include <vector>

#include "estimators/diagnose/missing/trial.h"

namespace imrig::est {

inline constexpr double kSure =
    4.0;  // standard errors; 16 candidates at a family-wise 1 % want 3.2 with many records
inline constexpr double kTold = 2.0;        // standard errors between two models on records left out
inline constexpr double kSameShare = 0.03;  // of the whole excess: forms are never exact
inline constexpr std::size_t kMostTrials = 9;
// chi2 a value that noise may leave: noise is never known better than this.
inline constexpr double kBand = 1.3;
inline constexpr double kByChance = 4.0;  // standard deviations; squares of few values are skew

struct SearchProgress {
  std::string what;
  std::size_t done = 0, total = 0;
};
using SearchReport = std::function<void(const SearchProgress&)>;

struct SearchStep {
  Trial base;  // the model as it is, refitted
  double noise_gain =
      0.0;  // drop of chi2 that noise of the voltage alone makes, by what it does to the parameters
  ScoreTest ranking;
  std::vector<Trial> trials;        // best first, judged on records left out
  std::vector<std::size_t> claims;  // trials that may be claimed; the first is the best
  std::vector<std::size_t>
      confusable;  // trials that cannot be told from the best, itself first; empty without a claim
};

// Forms of inactive effects that these data can show at all. by_record: temperatures as one value for each
// record too, where a law could stand for them.
std::vector<Candidate> candidates_for(const GlobalProblem& problem, const WorkingModel& model,
                                      bool by_record);

SearchStep search_step(const GlobalProblem& problem, Trial base, bool by_record, const SearchReport& report);

// Whether a form that frees a value for each record wins enough for that many values.
bool worth_its_values(const GlobalProblem& problem, const Trial& with, const Trial& base);

// What noise leaves of the misfit on records left out.
bool inside_band(const Trial& trial);

// Whether a refit takes most of a misfit that no noise makes. One start, or one log, may show an effect
// thousands of standard errors off and all by itself: then no other record asks for it, and signs of blocks
// cannot tell it from chance.
bool explains_most(const Trial& trial, const Trial& base);

// Whether noise and the accuracy of a torque bridge may leave this: few values, so by chance too.
bool torque_inside_band(const GlobalProblem& problem, const TorqueSums& torque);
double torque_chi2_per_value(const GlobalProblem& problem, const TorqueSums& torque);  // 0 without any

// The same of the shaft torque, which is a few values among the current's many.
bool explains_torque(const GlobalProblem& problem, const Trial& trial, const Trial& base);

// Richer forms of one active effect, kept where they win much and not on one record alone.
Trial enriched(const GlobalProblem& problem, const Trial& trial, std::size_t effect);

// Whether records left out cannot tell another model from the best. whole: excess without either.
bool same_worth(const Trial& best, const Trial& other, double whole, double values);

// The least family-wise p of an effect's forms; 1 where none has one.
double p_of(const ScoreTest& ranking, std::size_t effect);

// Excess of chi2 over what the best of these fits leaves a value.
double excess(const Trial& trial, double values);

}  // namespace imrig::est
