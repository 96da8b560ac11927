#include "plant/freewheel.h"

#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig::plant {
namespace {

constexpr int kMostEvents = 12;  // in one sample time
constexpr double kSameTime_s = 1e-12;
constexpr double kZero_A = 1e-10;
constexpr double kDrift_A = 1e-9;

}  // namespace

double Freewheel::current(const State& x, int phase) const {
  return phases(drive_.stator_current(x))[static_cast<std::size_t>(phase)];
}

void Freewheel::take_over(State& x) {
  bridge_.take_over(drive_.stator_current(x));
  if (bridge_.open()) drive_.set_stator_current(x, 0.0);
}

// The last moment before the phase's current turns, by bisection helped by the secant; `to` is left at that
// moment.
double Freewheel::find_zero(const State& from, State& to, int phase, double duration_s) {
  double low = 0.0, high = duration_s;
  double i_low = current(from, phase), i_high = current(to, phase);
  for (int round = 0; round < 100 && high - low > kSameTime_s; ++round) {
    const double secant = low + (high - low) * i_low / (i_low - i_high);
    const double middle = round % 3 == 2 ? 0.5 * (low + high) : secant;
    if (!(middle > low && middle < high)) break;
    to = from;
    integrator_.advance(to, middle, true);
    const double i = current(to, phase);
    if (std::abs(i) < kZero_A) return middle;
    if (bridge_.reversed(phase, i)) {
      high = middle, i_high = i;
    } else {
      low = middle, i_low = i;
    }
  }
  to = from;
  if (low > 0.0) integrator_.advance(to, low, true);
  return low;
}

Freewheel::Crossing Freewheel::first_reversal(const State& from, State& to, double duration_s) {
  Crossing first{-1, duration_s};
  for (int phase = 0; phase < 3; ++phase) {
    // `to` moves back to each crossing found, so a later phase is asked about the time before it; and an
    // earlier phase that had not turned by the stretch's end has not turned before.
    if (bridge_.reversed(phase, current(to, phase))) first = {phase, find_zero(from, to, phase, first.at_s)};
  }
  return first;
}

void Freewheel::advance(State& x, double duration_s, VoltageFilter& filter, bool fresh) {
  fresh_ = fresh_ || fresh;
  double left_s = duration_s;
  for (int event = 0; left_s > 0.0; ++event) {
    if (event >= kMostEvents && !bridge_.open()) {
      // Blocking everything gives away what the leakage still holds; it never adds any.
      bridge_.block_all();
      place_current(x, 0.0);
    }
    drive_.terminals = bridge_.terminals();
    while (event < kMostEvents && bridge_.conduct_where_forced(drive_.flow(x).at.v_s)) {
      drive_.terminals = bridge_.terminals();
      fresh_ = true;
    }
    const auto v_start = drive_.flow(x).at.v_s;
    const State from = x;
    integrator_.advance(x, left_s, fresh_);
    fresh_ = false;
    const Crossing crossing = first_reversal(from, x, left_s);
    filter.advance(v_start, drive_.flow(x).at.v_s, crossing.at_s);
    if (crossing.phase < 0) break;
    left_s -= crossing.at_s;
    place_current(x, bridge_.block(crossing.phase, drive_.stator_current(x)));
  }
  drive_.terminals = bridge_.terminals();
  // The open stator's flux follows the rotor's by integration; what rounding adds over hours is taken back.
  if (bridge_.open() && std::abs(drive_.stator_current(x)) > kDrift_A) place_current(x, 0.0);
}

void Freewheel::place_current(State& x, std::complex<double> i_s) {
  drive_.set_stator_current(x, i_s);
  fresh_ = true;
}

}  // namespace imrig::plant
