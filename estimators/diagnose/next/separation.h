#pragma once
// How far the members of a set of models lie apart on the data at hand and on each of some experiments; see
// next_experiment.h for the measure.

#include <vector>

#include "estimators/diagnose/next/imagine.h"

namespace imrig::est {

// Of an ordered pair: what is left of a's records when b is fitted to them, and when the base model is.
struct Apart {
  std::size_t a = 0, b = 0;  // of the members
  double left = 0.0;         // Delta
  double whole = 0.0;        // lambda
  double d() const;
  double cosine() const;
};

class Separation {
 public:
  // members: fitted to the data at hand. The problem, models and menu must outlive this.
  Separation(const GlobalProblem& problem, const WorkingModel& base,
             const std::vector<const WorkingModel*>& members, const std::vector<Experiment>& menu);

  std::size_t experiments() const { return first_.size() - 1; }
  const std::vector<Apart>& now() const { return now_; }
  // With the experiment's records beside the data; by one linearised step of each fit.
  const std::vector<Apart>& with(std::size_t experiment) const { return with_[experiment]; }
  // Likewise, each pair fitted to the end.
  std::vector<Apart> refitted(std::size_t experiment) const;

 private:
  void compare(std::size_t a);

  std::vector<const WorkingModel*> models_;  // the members, and the base model
  std::vector<std::size_t> fitted_;
  std::vector<std::size_t> first_;       // entry of each experiment's first record, and the end
  std::vector<GlobalProblem> measured_;  // by each member
  std::vector<GlobalPoint> at_;          // of each model
  std::vector<Apart> now_;
  std::vector<std::vector<Apart>> with_;
};

}  // namespace imrig::est
