#include "estimators/model/magnetic_tables.h"

#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <vector>

#include "estimators/model/effects/effect_machine.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr int kMostRounds = 60;
constexpr double kSettled = 1e-12,
                 kGoodEnough = 1e-9;  // of the current sought; what the node's own solution leaves
constexpr double kLeastPart = 1e-3;   // of a step
constexpr double kIncrement = 1e-4;   // relative step of the flux

// At standing flux only what bends the currents has a say; the others (iron's loss, dead time, ...) act on
// what moves.
Model magnetics_of(Model model) {
  std::erase_if(model.effects, [](const ActiveEffect& effect) {
    return effect.name != "magnetizing_saturation" && effect.name != "leakage_saturation";
  });
  return model;
}

class Magnetics {
 public:
  explicit Magnetics(const Model& model)
      : name_(model.name),
        machine_(shared_vector(magnetics_of(model)), neutral_local()),
        L_l_(machine_.base().L_l) {}

  // Stator current and the cage's own, A, at rest.
  struct Answer {
    Complex stator, rotor;
  };
  Answer at(Complex psi_s, Complex psi_r) const {
    const EffectState<double> x{{psi_s.real(), psi_s.imag()}, {psi_r.real(), psi_r.imag()}, {}};
    const auto inside = machine_.inside(x, 0.0, 0.0, Instant{});
    return {plain(inside.i), plain(inside.i_rotor)};
  }

  // Stator flux at which `wanted` of the answer is zero, starting at the linear motor's: Newton's method with
  // differences, damped, since steep leakage is far from linear.
  template <class Wanted>
  Complex stator_flux(Complex psi_r, Complex start_A, Wanted wanted) const {
    Complex psi_s = psi_r + L_l_ * start_A;
    const double scale = std::abs(start_A) + 1e-9, step = kIncrement * L_l_ * scale;
    Complex missing = wanted(at(psi_s, psi_r));
    for (int k = 0; k < kMostRounds && std::isfinite(std::abs(missing)); ++k) {
      if (std::abs(missing) < kSettled * scale) return psi_s;
      const Complex by_x = (wanted(at(psi_s + step, psi_r)) - missing) / step;
      const Complex by_y = (wanted(at(psi_s + Complex(0.0, step), psi_r)) - missing) / step;
      const double d = by_x.real() * by_y.imag() - by_y.real() * by_x.imag();
      const Complex whole(-(missing.real() * by_y.imag() - missing.imag() * by_y.real()) / d,
                          -(by_x.real() * missing.imag() - by_x.imag() * missing.real()) / d);
      double part = 1.0;
      Complex then = wanted(at(psi_s + whole, psi_r));
      for (; !(std::abs(then) < std::abs(missing)) && part > kLeastPart; part *= 0.5)
        then = wanted(at(psi_s + 0.5 * part * whole, psi_r));
      if (part <= kLeastPart) break;
      psi_s += part * whole, missing = then;
    }
    if (std::abs(missing) < kGoodEnough * scale) return psi_s;
    throw Error("model \"" + name_ + "\"",
                fmt::format("gives no stator flux at {} Wb in the rotor", std::abs(psi_r)));
  }

  double no_load_current_A(double psi_r) const {
    const double linear = psi_r / machine_.base().L_m;
    const Complex psi_s = stator_flux(psi_r, linear, [](const Answer& a) { return -a.rotor; });
    return at(psi_s, psi_r).stator.real();
  }

  double L_l() const { return L_l_; }

 private:
  std::string name_;
  EffectMachine<double> machine_;
  double L_l_;
};

}  // namespace

std::vector<MagnetizingRow> magnetizing_table(const Model& model, double psi_max_Wb, int rows) {
  const Magnetics magnetics(model);
  std::vector<MagnetizingRow> table;
  for (int k = 1; k <= rows; ++k) {
    const double psi = psi_max_Wb * k / rows, step = kIncrement * psi;
    MagnetizingRow row;
    row.psi_r_Wb = psi;
    row.i_d_A = magnetics.no_load_current_A(psi);
    row.L_m_H = psi / row.i_d_A;
    row.L_m_incremental_H =
        2.0 * step / (magnetics.no_load_current_A(psi + step) - magnetics.no_load_current_A(psi - step));
    table.push_back(row);
  }
  return table;
}

std::vector<LeakageRow> leakage_table(const Model& model, double psi_r_Wb, double i_q_max_A, int rows) {
  const Magnetics magnetics(model);
  const double i_d = magnetics.no_load_current_A(psi_r_Wb);
  std::vector<LeakageRow> table;
  for (int k = 0; k < rows; ++k) {
    const Complex wanted(i_d, i_q_max_A * k / (rows - 1));
    const Complex psi_s = magnetics.stator_flux(
        psi_r_Wb, wanted, [&](const Magnetics::Answer& a) { return wanted - a.stator; });
    LeakageRow row;
    row.i_q_A = wanted.imag();
    row.i_s_A = std::abs(wanted);
    row.L_l_H = std::abs(psi_s - psi_r_Wb) / row.i_s_A;
    table.push_back(row);
  }
  return table;
}

}  // namespace imrig::est
