#include "plant/diode_bridge.h"

#include <algorithm>
#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig::plant {
namespace {

constexpr double kNothing_A = 1e-9;

double pole(DiodeBridge::Leg leg, double half_V) {
  if (leg == DiodeBridge::Leg::kOff) return 0.0;
  return leg == DiodeBridge::Leg::kUpper ? half_V : -half_V;
}

}  // namespace

std::complex<double> DiodeBridge::axis(int phase) {
  static const std::array<SpaceVector, 3> axes = {SpaceVector{1.0, 0.0}, SpaceVector{-0.5, 0.5 * kSqrt3},
                                                  SpaceVector{-0.5, -0.5 * kSqrt3}};
  return axes[static_cast<std::size_t>(phase)];
}

int DiodeBridge::conducting() const {
  return static_cast<int>(
      std::count_if(legs_.begin(), legs_.end(), [](Leg leg) { return leg != Leg::kOff; }));
}

void DiodeBridge::take_over(std::complex<double> i_s) {
  const auto i = phases(i_s);
  for (std::size_t k = 0; k < 3; ++k) {
    legs_[k] = std::abs(i[k]) < kNothing_A ? Leg::kOff : i[k] > 0.0 ? Leg::kLower : Leg::kUpper;
  }
  if (conducting() < 2) block_all();
}

Terminals DiodeBridge::terminals() const {
  const SpaceVector v =
      space_vector(pole(legs_[0], half_V_), pole(legs_[1], half_V_), pole(legs_[2], half_V_));
  switch (conducting()) {
    case 3:
      return {Terminals::Kind::kClamped, v, 1.0};
    case 2: {
      const auto off = std::find(legs_.begin(), legs_.end(), Leg::kOff) - legs_.begin();
      return {Terminals::Kind::kPair, v, axis(static_cast<int>(off))};
    }
    default:
      return {};
  }
}

bool DiodeBridge::conduct_where_forced(std::complex<double> v_s) {
  const auto v = phases(v_s);
  if (conducting() == 2) {
    // The star point lies at half the floating phase's voltage, since the two poles cancel.
    const auto off =
        static_cast<std::size_t>(std::find(legs_.begin(), legs_.end(), Leg::kOff) - legs_.begin());
    const double potential = 1.5 * v[off];
    if (std::abs(potential) <= half_V_) return false;
    legs_[off] = potential > 0.0 ? Leg::kUpper : Leg::kLower;
    return true;
  }
  if (!open()) return false;
  const auto high = std::max_element(v.begin(), v.end()), low = std::min_element(v.begin(), v.end());
  if (*high - *low <= 2.0 * half_V_) return false;
  legs_[static_cast<std::size_t>(high - v.begin())] = Leg::kUpper;
  legs_[static_cast<std::size_t>(low - v.begin())] = Leg::kLower;
  return true;
}

bool DiodeBridge::reversed(int phase, double current_A) const {
  const Leg leg = legs_[static_cast<std::size_t>(phase)];
  return (leg == Leg::kLower && current_A < -kNothing_A) || (leg == Leg::kUpper && current_A > kNothing_A);
}

std::complex<double> DiodeBridge::block(int phase, std::complex<double> i_s) {
  legs_[static_cast<std::size_t>(phase)] = Leg::kOff;
  if (conducting() < 2) {
    block_all();
    return 0.0;
  }
  const SpaceVector along = axis(phase);
  const SpaceVector left = i_s - along * (i_s.real() * along.real() + i_s.imag() * along.imag());
  const auto i = phases(left);
  for (int k = 0; k < 3; ++k) {
    // Two currents that vanish together leave a pair that is empty or runs against its diodes.
    if (k != phase && (std::abs(i[static_cast<std::size_t>(k)]) < kNothing_A ||
                       reversed(k, i[static_cast<std::size_t>(k)]))) {
      block_all();
      return 0.0;
    }
  }
  return left;
}

}  // namespace imrig::plant
