#pragma once
// What a settled standstill fit is worth: bias of the voltage's noise subtracted, intervals from white noise
// and from block to block (jackknife), how well the record excites each parameter, the T circuit.

#include <vector>

#include "estimators/fit/standstill/standstill_search.h"

namespace imrig::est::standstill {

class Judgement {
 public:
  Judgement(const AxisRecord& record, const StandstillFitOptions& options, const Search& found,
            const Prior& prior = {});

  // The weight that an R_s from elsewhere has beside this record: the record's own sigma of R_s over its
  // sigma for a misfit of 1 A per sample is the ampere per sample that its noise amounts to.
  Prior prior_of(const KnownResistance& known, const StandstillFit& free) const;

  void fill(StandstillFit& fit);

 private:
  Matrix4 of_prior(const Matrix& inverse) const;  // what the uncertainty of the given R_s brings
  double samples() const { return static_cast<double>(record_.size()); }
  double sigma_along(const Vector4& d) const;
  void goodness(StandstillFit& fit) const;
  void subtract_noise_bias(const Matrix& inverse, StandstillFit& fit);
  void in_t_circuit(StandstillFit& fit) const;

  const AxisRecord& record_;
  const StandstillFitOptions& options_;
  Prior prior_;
  Point at_;
  std::vector<double> residual_;
  std::vector<Sums> blocks_;
  Sums data_, all_;  // all_: with the prior
  Matrix4 noise_, scatter_;
};

}  // namespace imrig::est::standstill
