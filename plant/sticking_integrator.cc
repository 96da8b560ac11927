#include "plant/sticking_integrator.h"

#include <cmath>
#include <cstring>

namespace imrig::plant {
namespace {

constexpr double kSameTime_s = 1e-13;
constexpr double kStopped_rad_s = 1e-12;

bool reversed(Motion motion, double speed) {
  return motion == Motion::kForward ? speed < 0.0 : motion == Motion::kBackward && speed > 0.0;
}

}  // namespace

std::unique_ptr<Integrator> with_sticking(std::unique_ptr<Integrator> inner, Drive& drive) {
  if (drive.break_away_Nm() <= 0.0 || drive.shaft_is_held()) return inner;
  return std::make_unique<StickingIntegrator>(std::move(inner), drive);
}

Motion StickingIntegrator::motion_at(const State& x) {
  if (x[kSpeed] != 0.0) return x[kSpeed] > 0.0 ? Motion::kForward : Motion::kBackward;
  const double pull_Nm = drive_.pull_at_rest_Nm(x, inner_->flow(x));
  if (std::abs(pull_Nm) <= drive_.break_away_Nm()) return Motion::kResting;
  return pull_Nm > 0.0 ? Motion::kForward : Motion::kBackward;
}

// The last moment before the speed changes its sign, by bisection helped by the secant; x is left there.
double StickingIntegrator::find_stop(const State& from, State& x, double duration_s) {
  double low = 0.0, high = duration_s, w_low = from[kSpeed], w_high = x[kSpeed];
  for (int round = 0; round < 100 && high - low > kSameTime_s; ++round) {
    const double secant = low + (high - low) * w_low / (w_low - w_high);
    const bool use = round % 3 != 2 && secant > low && secant < high;
    const double middle = use ? secant : 0.5 * (low + high);
    if (!(middle > low && middle < high)) break;
    x = from;
    inner_->advance(x, middle, true);
    if (std::abs(x[kSpeed]) < kStopped_rad_s) return middle;
    (reversed(drive_.shaft, x[kSpeed]) ? high : low) = middle;
    (reversed(drive_.shaft, x[kSpeed]) ? w_high : w_low) = x[kSpeed];
  }
  x = from;
  if (low > 0.0) inner_->advance(x, low, true);
  return low;
}

void StickingIntegrator::advance(State& x, double duration_s, bool fresh) {
  fresh_ = fresh_ || fresh;
  double left_s = duration_s;
  for (int event = 0;; ++event) {
    const Motion motion = event < kMostEvents ? motion_at(x) : Motion::kResting;
    fresh_ = fresh_ || motion != drive_.shaft;
    drive_.shaft = motion;
    if (left_s <= kSameTime_s) return;
    std::memcpy(from_.data(), x.data(), drive_.size() * sizeof(double));
    inner_->advance(x, left_s, fresh_);
    fresh_ = false;
    if (!reversed(motion, x[kSpeed])) return;
    left_s -= find_stop(from_, x, left_s);
    x[kSpeed] = 0.0;
    fresh_ = true;
  }
}

}  // namespace imrig::plant
