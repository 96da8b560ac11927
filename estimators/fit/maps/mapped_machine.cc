#include "estimators/fit/maps/mapped_machine.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {
constexpr std::size_t kTable = 512;
constexpr double kMostShare = 0.8;  // a collapsing flux makes the slip frequency unbounded; a bar's resistance is not
constexpr int kRounds = 200;
constexpr double kSettled = 1e-10;
}  // namespace

MappedMachine::MappedMachine(const ParameterMaps& maps, const MachineParameters<double>& base, double stator_C,
                             double w_supply)
    : maps_(&maps), base_(base), stator_C_(stator_C), w_supply_(std::abs(w_supply)) {
  R_s_ = maps.R_s.failure.empty() && maps.R_s.R_20.known() ? maps.R_s.at(stator_C) : base.R_s;
  if (maps.R_r.bar.known()) {
    R_2_ = maps.R_r.bar.R_2_at(R_1());
    L_2_ = maps.R_r.bar.L_2.value;
  }
  if (!maps.L_m.known()) return;
  // psi(I) = L_m(I) I rises; its inverse by interpolation, and on a straight line of the last slope beyond.
  const double most_A = 2.0 * maps.L_m.highest_A;
  std::vector<double> I, psi;
  for (std::size_t k = 0; k <= kTable; ++k) {
    const double at = most_A * static_cast<double>(k) / kTable;
    const double flux = (maps.L_m.at(at) + L_2_) * at;
    if (!psi.empty() && flux <= psi.back()) continue;  // the parabola's far side
    I.push_back(at);
    psi.push_back(flux);
  }
  flux_.resize(kTable + 1);
  inverse_.resize(kTable + 1);
  std::size_t place = 0;
  for (std::size_t k = 0; k <= kTable; ++k) {
    flux_[k] = psi.back() * static_cast<double>(k) / kTable;
    while (place + 2 < psi.size() && psi[place + 1] < flux_[k]) ++place;
    const double share = (flux_[k] - psi[place]) / (psi[place + 1] - psi[place]);
    inverse_[k] = k == 0 ? 1.0 / (maps.L_m.L_0.value + L_2_) : (I[place] + share * (I[place + 1] - I[place])) / flux_[k];
  }
}

double MappedMachine::inverse_L_m(double psi) const {
  if (flux_.empty()) return 1.0 / (base_.L_m + L_2_);
  const double at = std::min(psi / flux_[1], static_cast<double>(kTable) - 1e-9);
  const auto k = static_cast<std::size_t>(at);
  return inverse_[k] + (at - static_cast<double>(k)) * (inverse_[k + 1] - inverse_[k]);
}

double MappedMachine::R_c(double w_e, double psi) const {
  return maps_->core.failure.empty() && w_e > 0.0 && psi > 0.0 ? maps_->core.physics.R_c(w_e, psi)
                                                               : std::numeric_limits<double>::infinity();
}

double MappedMachine::kappa(double psi) const {
  const double L_m = 1.0 / inverse_L_m(psi) - L_2_, moved = 1.0 + L_2_ / L_m;
  const double share =
      maps_->R_r.known() && maps_->L_m.known() ? rotor_share(L_m, maps_->L_m.L_0.value, L_l(0.0)) : 1.0;
  return share * moved * moved;
}

std::complex<double> MappedMachine::rotor(double w_s, double psi) const {
  if (!bars()) return maps_->R_r.known() ? maps_->R_r.at(w_s, stator_C_, kappa(psi)) : base_.R_r;
  const double k = kappa(psi);
  const std::complex<double> x(0.0, std::abs(w_s) * L_2_);
  const std::complex<double> Z = k * R_1() + x * (k * R_2_) / (x + k * R_2_);
  return w_s < 0.0 ? std::conj(Z) : Z;
}

Cx<double> MappedMachine::current(const State& x) const {
  const Cx<double> across = x.psi_s - x.psi_r;
  const double flux = std::sqrt(norm(across));
  double I = flux / series_L(0.0);
  for (int round = 0; round < 3; ++round) I = flux / series_L(I);  // the map is all but constant
  return scaled(1.0 / series_L(I), across);
}

MappedState MappedMachine::steady_state(std::complex<double> psi_s, std::complex<double> i_s) const {
  State x;
  x.psi_s = Cx<double>(psi_s);
  x.psi_r = Cx<double>(psi_s - series_L(std::abs(i_s)) * i_s);
  if (bars()) x.i_2 = Cx<double>(i_s) - scaled(inverse_L_m(std::sqrt(norm(x.psi_r))), x.psi_r);
  return x;
}

// EMF behind the leakage, from the current that R_c and the rotor share; with bars.
Cx<double> MappedMachine::rotor_emf(const State& x, const Cx<double>& drive, double k, double iron, double w_r,
                                    Cx<double>& d_i_2) const {
  const double R_2 = k * R_2_, R = k * R_1() + R_2;
  const Cx<double> held = scaled(R_2, x.i_2), turning = turned(w_r, x.psi_r);
  const Cx<double> i_r = scaled(1.0 / (1.0 + iron * R), drive - scaled(iron, turning - held));
  d_i_2 = scaled(R_2 / L_2_, i_r - x.i_2) + turned(w_r, x.i_2);
  return scaled(R, i_r) - held + turning;
}

// The same with R_r = R_1 + k_6 w_s, w_s the instantaneous slip frequency of the rotor flux.
Cx<double> MappedMachine::line_emf(const State& x, const Cx<double>& drive, double k, double iron, double w_r) const {
  double R = k * R_1();
  const double psi2 = norm(x.psi_r);
  if (maps_->R_r.k_6.known() && psi2 > 0.0) {
    const double cross = std::abs(x.psi_r.re * drive.im - x.psi_r.im * drive.re);
    R /= 1.0 - std::min(kMostShare, k * maps_->R_r.k_6.value * cross / psi2);
  }
  return scaled(1.0 / (iron + 1.0 / R), drive + turned(w_r / R, x.psi_r));
}

MappedState MappedMachine::derivative(const State& x, std::complex<double> v, double w_r, double w_k) const {
  const Cx<double> i = current(x);
  const double psi = std::sqrt(norm(x.psi_r));
  const Cx<double> drive = i - scaled(inverse_L_m(psi), x.psi_r);  // through R_c and R_r
  const double k = kappa(psi), iron = 1.0 / R_c(w_supply_, psi);
  State d;
  const Cx<double> e = bars() ? rotor_emf(x, drive, k, iron, w_r, d.i_2) : line_emf(x, drive, k, iron, w_r);
  d.psi_s = Cx<double>(v.real() - R_s_ * i.re + w_k * x.psi_s.im, v.imag() - R_s_ * i.im - w_k * x.psi_s.re);
  d.psi_r = Cx<double>(e.re + w_k * x.psi_r.im, e.im - w_k * x.psi_r.re);
  d.i_2 = Cx<double>(d.i_2.re + w_k * x.i_2.im, d.i_2.im - w_k * x.i_2.re);
  return d;
}

MappedSteady mapped_steady(const MappedMachine& m, double v, double w_e, double w_r) {
  using Complex = std::complex<double>;
  const Complex j(0.0, 1.0);
  const double w_s = w_e - w_r;
  double psi = v / w_e, I = 0.0;
  MappedSteady out;
  for (int round = 0; round < kRounds; ++round) {
    const Complex Y = m.inverse_L_m(psi) / (j * w_e) + 1.0 / m.R_c(w_e, psi) + w_s / (w_e * m.rotor(w_s, psi));
    const Complex i = v / (m.R_s() + j * w_e * m.series_L(I) + 1.0 / Y);
    const double next = std::abs(i / Y) / w_e;
    const bool settled = std::abs(next - psi) < kSettled * psi;
    out.i_s = i;
    I = std::abs(i);
    psi += 0.5 * (next - psi);  // damped: deep saturation overshoots
    if (settled) {
      out.settled = true;
      break;
    }
  }
  out.p_in_W = 1.5 * v * out.i_s.real();
  return out;
}

}  // namespace imrig::est
