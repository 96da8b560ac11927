#pragma once
// A model as the global problem sees it while effects come and go: which effects are active in which form,
// hence what is free, and where the parameters stand.

#include <string>
#include <vector>

#include "estimators/fit/global/global_fit.h"
#include "estimators/model/model.h"

namespace imrig::est {

// One effect of the library in one of its forms.
struct Candidate {
  std::size_t effect = 0;
  std::size_t form = 0;
  friend bool operator==(const Candidate&, const Candidate&) = default;
};

std::string name_of(const Candidate& candidate);  // of the effect
const EffectForm& form_of(const Candidate& candidate);
bool needs_torque(const Candidate& candidate);  // it shows in the shaft's torque alone
bool any_needs_torque(const std::vector<Candidate>& candidates);

// Entries of the vectors that a candidate frees.
std::vector<std::size_t> shared_entries(const Candidate& candidate);
std::vector<std::size_t> local_entries(
    const Candidate& candidate);  // the deep layer's initial current included

struct WorkingModel {
  std::vector<Candidate> active;
  GlobalPoint at;
  GlobalFit fit;              // of the training entries; its covariance gives the intervals
  std::vector<Prior> priors;  // R_s as the DC test left it; sensor errors inside their declared accuracy
  std::vector<std::size_t>
      nuisances;  // entries that are free inside their accuracy, unless their effect is active
  std::vector<std::size_t> local_nuisances;  // likewise of each record: what rounding left of its speed
  // Errors of the torque transducer, which no fit follows: friction would hide behind them. What they may do
  // to the fit's free entries, one sigma; empty where no effect needs the torque.
  std::vector<Prior> considered;
  std::vector<double> unseen;
  bool R_s_has_temperature = false;  // the DC test's winding temperature is known
  double common_gain = 0.0;  // declared sigma of the mean gain error, current against voltage
  std::vector<std::size_t> barred;  // effects that the user has ruled out
  std::array<Bounds, kBase> base_reach = Freedom{}.base;  // where a search lets the base parameters go

  Freedom freedom() const;
  std::vector<Prior> live_priors() const;  // without those of active effects, and those that they spoil
  bool has(std::size_t effect) const;
  bool R_s_follows_temperature() const;  // as measured, not by a value for each record
  // Sigma of what the gain errors of all channels together do to every impedance, which no fit sees: as declared, and
  // where channels do not match each other by more than that, their mean is as unsure as three errors of that size make
  // it.
  double gain_sigma() const;
  // What errors of the transducer may do to a shared entry.
  double unseen_sigma(std::size_t entry) const;
  // Of a shared entry: the fit's, what it does not see, and of an impedance what the gains of the sensors may
  // hide. NaN where it was not free.
  double sigma(std::size_t entry) const;
};

// The effects of a model in their forms. Throws Error: unknown form.
std::vector<Candidate> active_effects(const Model& model);

// From a model: its effects in their forms, references filled in from the data where the model has none.
WorkingModel working_model(const GlobalProblem& problem, const Model& model);

// Keeps the base parameters within five times what the model came with (identify's rough starts are as near
// as that), thirty times where somebody gave it without an interval or a DC test did. No effect moves them
// further; where data leave one open, a misfit of another kind would.
void keep_in_reach(const Model& model, WorkingModel& working);

// "R_r", ... that ended where the reach does.
std::vector<std::string> at_the_end_of_reach(const WorkingModel& working);

// References (flux, leakage flux) of all effects that take theirs from the data.
void fill_references(const GlobalProblem& problem, SharedVector<double>& shared);

// A change of this size of an amplitude matters to an engineer, on this motor.
double material_size(const GlobalProblem& problem, const SharedVector<double>& shared, std::size_t entry);

// Back into a model: parameters with intervals, effects with forms; the rest as in `before`.
Model to_model(const Model& before, const WorkingModel& working);

}  // namespace imrig::est
