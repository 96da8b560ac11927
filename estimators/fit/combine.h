#pragma once
// One value from many records. Weighted mean with weights 1/(sigma_k^2 + tau^2), tau^2 the variance between
// records beyond their own noise (DerSimonian and Laird 1986); its interval from the scatter between records
// (Hartung and Knapp 2001, Student's t with n - 1), never smaller than what the records' own sigmas say: from
// record to record, not from the sample count. A record far from the others (kOutlier robust standard
// deviations from the median) is set aside, with the reason.

#include <cstddef>
#include <string>
#include <vector>

namespace imrig::est {

struct Contribution {
  double value = 0.0;
  double sigma = 0.0;  // independent from record to record
};

struct Combined {
  double value = 0.0;
  double sigma = 0.0;                // of the mean
  double degrees_of_freedom = 0.0;   // of sigma; infinity when the records' own sigmas decide
  double scatter = 0.0;              // tau
  std::vector<std::string> outlier;  // per contribution: why it was set aside, or empty
  std::size_t used = 0;
};

// At least one contribution, sigmas > 0.
Combined combine(const std::vector<Contribution>& all);

// Half the width of the 95 % interval: t times sigma, with common_sigma (the same in all records: gains, R_s)
// added in quadrature.
double half_width_95(const Combined& combined, double common_sigma);

}  // namespace imrig::est
