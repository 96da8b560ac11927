#pragma once
// The model's shaft torque over the windows of a record (torque_windows.h), as means of samples spread
// over each, and its part of the record's sums.

#include <cmath>
#include <vector>

#include "estimators/fit/global/driven_motion.h"
#include "estimators/fit/global/record_terms.h"

namespace imrig::est {

template <int N>
class TorqueMeans {
 public:
  explicit TorqueMeans(const DrivenRecord& record) : record_(record), sums_(record.torque.size()) {}

  bool wants(std::size_t k) {
    const auto& windows = record_.torque;
    while (window_ < windows.size() && k >= windows[window_].to) ++window_;
    if (window_ == windows.size() || k < windows[window_].from) return false;
    const TorqueWindow& w = windows[window_];
    // Spread by the golden section, so that no ripple of the torque keeps step with them.
    const double place = kGolden * static_cast<double>(k - w.from);
    return (place - std::floor(place)) * static_cast<double>(w.to - w.from) < kMostSamples;
  }
  void operator()(std::size_t, const DrivenTorque<N>& torque) {
    Sum& sum = sums_[window_];
    sum.value += torque.value_Nm;
    sum.change += torque.change;
    sum.n += 1.0;
  }

  void add_to(RecordTerms& terms, Eigen::Index used) const {
    const std::size_t from = record_.frame.judged_from, judged = record_.size() - from;
    for (std::size_t w = 0; w < sums_.size(); ++w) {
      const TorqueWindow& window = record_.torque[w];
      const double error_Nm = sums_[w].value / sums_[w].n - window.mean_Nm,
                   error = error_Nm / window.sigma_Nm;
      const Eigen::VectorXd row = (sums_[w].change.head(used) / (sums_[w].n * window.sigma_Nm)).transpose();
      const std::size_t stretch = ((window.from + window.to) / 2 - from) * kStretches / judged;
      terms.chi2 += error * error;
      terms.values += 1;
      terms.stretch_chi2[stretch] += error * error;
      terms.gradient += error * row;
      terms.stretch_gradient.col(static_cast<Eigen::Index>(stretch)) += error * row;
      terms.normal += row * row.transpose();
      terms.torque.add(error_Nm, window.mean_Nm, window.sigma_Nm);
    }
  }
  std::vector<double> predicted_Nm() const {
    std::vector<double> out;
    for (const Sum& sum : sums_) out.push_back(sum.value / sum.n);
    return out;
  }

 private:
  static constexpr double kMostSamples = 600.0;  // a window, about
  static constexpr double kGolden = 0.61803398874989485;
  struct Sum {
    double value = 0.0, n = 0.0;
    Eigen::Matrix<double, 1, N> change = Eigen::Matrix<double, 1, N>::Zero();
  };
  const DrivenRecord& record_;
  std::vector<Sum> sums_;
  std::size_t window_ = 0;
};

}  // namespace imrig::est
