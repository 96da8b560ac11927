#pragma once
// A model refitted with one change (an effect more, a richer form, an effect less), judged on what it was not
// fitted to: each record by the parameters that the other records give (leave one record out, to first order
// from the normal equations), and the hold-out records.

#include <algorithm>
#include <string>
#include <vector>

#include "estimators/diagnose/missing/score_test.h"

namespace imrig::est {

struct Trial {
  Candidate candidate;  // what was added
  WorkingModel model;
  bool sound = false;
  std::string unsound;           // why not
  bool determined = true;        // no amplitude of what was added lies in a direction that the data leave open
  double chi2 = 0.0;             // of the fitted entries
  double left_out_chi2 = 0.0;    // sum over records, each judged by the others
  std::vector<double> left_out;  // of each fitted entry
  double wald = 0.0;             // sqrt of the Wald statistic of its amplitudes, from record to record
  TorqueSums torque;             // of the fitted entries
  double size = 0.0;             // largest amplitude over what matters to an engineer
  double size_scatter = 0.0;     // of a broken bar's values for each record, over their mean
};

// Sums over records.
struct Judgement {
  double error2 = 0.0, signal2 = 0.0, noise2 = 0.0;  // A^2
  double chi2 = 0.0, values = 0.0;
  double series_error2 = 0.0;    // A^2, of time series alone
  double noise2_variance = 0.0;  // of what noise makes of it
  TorqueSums torque;             // of steady stretches of time series
  double edges2 = 0.0;  // what steps of the voltage may add that always fall on the same part of a sample
  double nrmse() const;
  double floor() const;
  double chi2_per_value() const;
  // Power of the error over what noise and edges leave of it, unwhitened: it sees slow errors (of a
  // resistance) that are few among the whitened values. 1 without time series.
  double error_over_noise() const;
  double error_over_noise_sigma() const;  // by chance
};

// The last fit of a model that is kept: to the end, and freed from what noise of the voltage does to it.
Trial finished(const GlobalProblem& problem, const WorkingModel& model,
               const std::vector<std::size_t>& which);

// chi2 a degree of freedom, 1 at least: in its units drops of chi2 count where something else is missing too.
inline double scale_of(const Trial& trial) {
  return std::max(1.0, trial.chi2 / std::max(1.0, trial.model.fit.dof));
}

// Each record by the parameters that the others give, over what noise leaves: 1.
inline double chi2_per_value(const Trial& trial) {
  return trial.left_out_chi2 / static_cast<double>(trial.model.fit.values);
}

// The current model refitted by itself.
Trial refit(const GlobalProblem& problem, const WorkingModel& model, const std::vector<std::size_t>& which);

// With `score`'s candidate added, started from its forecast.
Trial try_adding(const GlobalProblem& problem, const WorkingModel& model, const Score& score,
                 const std::vector<std::size_t>& which);

// `best`, found from the tried-th scanned shape, or what is found from another one where that fits better. In
// `from` its effect may be active or not.
void try_other_shapes(const GlobalProblem& problem, const WorkingModel& from, std::size_t tried,
                      const std::vector<std::size_t>& which, Trial& best);

// With the form of an active effect replaced.
Trial try_form(const GlobalProblem& problem, const WorkingModel& model, const Candidate& form,
               const std::vector<std::size_t>& which);

Trial try_removing(const GlobalProblem& problem, const WorkingModel& model, std::size_t effect,
                   const std::vector<std::size_t>& which);

// With one active effect in another's place; the newcomer starts from where `source`, a fit that had it, left
// it.
Trial try_swapping(const GlobalProblem& problem, const WorkingModel& model, std::size_t effect,
                   const Trial& source, const std::vector<std::size_t>& which);

// What the model makes of entries whose own unknowns are estimated and nothing else.
Judgement judge(const GlobalProblem& problem, const WorkingModel& model,
                const std::vector<std::size_t>& which);

// How surely a is better than b on records left out: mean difference over its standard error, record by
// record.
double surely_better(const Trial& a, const Trial& b);
double surely_better(const std::vector<double>& gains);

// Of each record that both were judged on when it was left out: how much less a leaves than b.
std::vector<double> left_out_gains(const Trial& a, const Trial& b);

}  // namespace imrig::est
