#include "bench/hidden/other_machine.h"

#include <cmath>
#include <random>

#include "rig/base/error.h"

namespace imrig::bench {
namespace {

constexpr double kStep_s = 60e-6;

// Current for a stator flux, the rotor at `turn`.
SpaceVector current(const OtherMachine& m, SpaceVector psi, SpaceVector turn) {
  const SpaceVector dq = psi * std::conj(turn);
  return SpaceVector((dq.real() - m.psi_m) / m.L_d, dq.imag() / m.L_q) * turn;
}

}  // namespace

OtherMachine other_machine(const std::string& name, const Machine& m) {
  const double L = m.L_l + m.L_m;
  if (name == "permanent_magnet") return {m.R_s, 0.25 * L, 0.25 * L, 0.85 * m.psi_Wb};
  if (name == "reluctance") return {m.R_s, L, 0.2 * L, 0.0};
  throw Error("hidden", "no machine is called \"" + name + "\"");
}

Record other_record(const OtherMachine& other, const Machine& m, double f_Hz, double flux, double load, bool locked,
                    const Noise& noise, double sample_time_s, double length_s, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  std::normal_distribution<double> normal;
  const auto noisy = [&](SpaceVector x, double sigma) {
    const double re = normal(bits), im = normal(bits);
    return x + sigma * SpaceVector(re, im);
  };
  const double w = 2.0 * kPi * f_Hz, settle_s = 10.0 * other.L_d / other.R_s;
  // The voltage that turns the flux, which leads the rotor's axis by the load angle.
  const double angle = load * (other.psi_m > 0.0 ? 0.5 : 0.25) * kPi;
  const double size = locked ? 0.2 * m.psi_Wb : flux * m.psi_Wb;
  const SpaceVector psi_0 = std::polar(size, angle), turn_0 = 1.0;
  const SpaceVector v_0 = SpaceVector(0.0, w) * psi_0 + other.R_s * current(other, psi_0, turn_0);
  Record out;
  out.kind = RecordKind::kStep;
  TimeSeries& s = out.series;
  s.sample_time_s = sample_time_s;
  SpaceVector psi = psi_0;
  const auto turn = [&](double t) { return locked ? SpaceVector(1.0) : std::polar(1.0, w * t); };
  const auto voltage = [&](double t) {
    const double u = (t - settle_s) / length_s;
    return std::polar(1.0, w * t) * v_0 * (u > 0.25 && u < 0.65 ? 1.1 : 1.0);
  };
  const auto thin = static_cast<std::size_t>(std::lround(sample_time_s / kStep_s));
  const auto before = static_cast<std::size_t>(settle_s / kStep_s), steps = static_cast<std::size_t>(length_s / kStep_s);
  for (std::size_t k = 0; k < before + steps; ++k) {
    const double t = kStep_s * static_cast<double>(k);
    if (k >= before && (k - before) % thin == 0) {
      s.i.push_back(noisy(current(other, psi, turn(t)), noise.current_A));
      s.v.push_back(noisy(voltage(t), noise.voltage_V));
      s.speed_rad_s.push_back((locked ? 0.0 : w / m.pole_pairs) + noise.speed_rad_s * normal(bits));
    }
    const auto rate = [&](double at, SpaceVector x) { return voltage(at) - other.R_s * current(other, x, turn(at)); };
    const double h = kStep_s;
    const SpaceVector a = rate(t, psi), b = rate(t + 0.5 * h, psi + 0.5 * h * a),
                      c = rate(t + 0.5 * h, psi + 0.5 * h * b), d = rate(t + h, psi + h * c);
    psi += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return out;
}

}  // namespace imrig::bench
