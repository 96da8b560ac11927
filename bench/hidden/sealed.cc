#include "bench/hidden/sealed.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include "bench/hidden/other_machine.h"
#include "plant/plant.h"
#include "plant/plant_config.h"
#include "rig/base/space_vector.h"
#include "rig/bus/speed_from_counts.h"

namespace imrig::bench {
namespace {

constexpr double kStep_s = 60e-6, kFilter_s = 160e-6, kRamp_s = 6e-3;
constexpr double kGain = 0.001;  // declared and drawn: SensorsConfig::gain_sigma
constexpr int kZeroSamples = 25000;  // 1.5 s, as a campaign rests
constexpr double kTorqueGain = 0.0015, kTorqueZero = 5e-4, kTorqueNoise = 5e-3;  // the latter two of rated

// One record's drive.
struct Profile {
  double f_Hz = 0.0, v_V = 0.0, step = 0.0, speed_rad_s = 0.0;
  double settle_s = 0.0, length_s = 0.0;
  bool dc = false, axis = false;
  bool edge = false;  // at the end of the range: a model is not asked to reach beyond what it was fitted to
};

double smooth(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

SpaceVector asked(const Profile& p, double t) {
  if (p.dc) return p.v_V;
  if (p.axis) return {0.0, p.v_V * std::cos(2.0 * kPi * p.f_Hz * t)};
  const double u = t - p.settle_s;
  const double up = smooth((u - 0.25 * p.length_s) / kRamp_s) - smooth((u - 0.65 * p.length_s) / kRamp_s);
  return std::polar(p.v_V * (1.0 + p.step * up), 2.0 * kPi * p.f_Hz * t);
}

// Stator current and voltage for a stator flux at a slip frequency, inverse-gamma circuit.
struct Steady {
  double i_A, v_V;
};
Steady steady(const Machine& m, double w, double w_slip, double psi_Wb) {
  const std::complex<double> L = m.L_l + m.L_m / std::complex<double>(1.0, w_slip * m.L_m / m.R_r);
  const double i = psi_Wb / std::abs(L);
  return {i, i * std::abs(m.R_s + std::complex<double>(0.0, w) * L)};
}

double settle_s(const Machine& m) { return std::min(0.8, 3.0 * (m.L_l + m.L_m) / (m.R_s + m.R_r) + 0.05); }

// Frequency x flux x load, then locked sweeps; points beyond the inverter or three times rated stay out.
std::vector<Profile> profiles(const Machine& m, double length_s, bool poor, std::mt19937_64& bits) {
  std::vector<Profile> all;
  const auto add = [&](double f_Hz, double w_slip, double psi_Wb) {
    const double w = 2.0 * kPi * f_Hz;
    const Steady at = steady(m, w, w_slip, psi_Wb);
    const double step = uniform(bits, 0.1, 0.2);
    if (at.v_V * (1.0 + step) > 1.25 * m.v_V || at.i_A > 3.1 * m.i_A) return;
    all.push_back({f_Hz, at.v_V, step, (w - w_slip) / m.pole_pairs, settle_s(m), length_s, false});
  };
  for (const double f : {30.0, 60.0}) {
    for (const double load : {0.05, 0.4, 0.8, 1.2}) {
      if (poor) add(f * m.f_Hz / 60.0, load * m.w_slip_rad_s, 0.8 * m.psi_Wb);
    }
  }
  if (poor) return all;
  for (const double f : {20.0, 40.0, 60.0}) {
    for (const double flux : {0.3, 0.55, 0.8, 1.05}) {
      for (const double load : {0.05, 0.5, 1.2})
        add(f * m.f_Hz / 60.0, load * m.w_slip_rad_s, flux * m.psi_Wb);
    }
  }
  for (const auto& [f, current] : {std::pair{20.0, 0.6},
                                   {20.0, 1.5},
                                   {40.0, 0.6},
                                   {60.0, 0.6},
                                   {60.0, 1.1},
                                   {60.0, 1.7},
                                   {60.0, 2.3},
                                   {60.0, 2.8}}) {
    const double f_Hz = f * m.f_Hz / 60.0, w = 2.0 * kPi * f_Hz;
    add(f_Hz, w, current * m.i_A / steady(m, w, w, 1.0).i_A);
  }
  all.back().edge = true;  // the largest current
  return all;
}

// Operating points anywhere between those of the grid, held out: the grid's own few leave the error over the
// floor to chance (a standard deviation of 5 % with seven records).
std::vector<Profile> held_out_profiles(const Machine& m, const SealOptions& options, std::mt19937_64& bits) {
  std::vector<Profile> all;
  while (all.size() < options.held_out) {
    const double w = 2.0 * kPi * m.f_Hz * uniform(bits, 0.34, 1.0), step = uniform(bits, 0.1, 0.2);
    const double flux = uniform(bits, 0.3, 1.05), w_slip = m.w_slip_rad_s * uniform(bits, 0.05, 1.2);
    const Steady at = steady(m, w, w_slip, flux * m.psi_Wb);
    if (at.v_V * (1.0 + step) > 1.25 * m.v_V || at.i_A > 2.0 * m.i_A) continue;
    all.push_back(
        {w / (2.0 * kPi), at.v_V, step, (w - w_slip) / m.pole_pairs, settle_s(m), options.record_s, false});
  }
  return all;
}

std::vector<Profile> dc_profiles(const Machine& m) {
  std::vector<Profile> all;
  for (const double current : {0.5, 1.0})
    all.push_back(
        {0.0, current * m.i_A * m.R_s, 0.0, 0.0, std::min(6.0, 8.0 * (m.L_l + m.L_m) / m.R_r), 0.3, true});
  return all;
}

using Zeros = std::array<double, 6>;

Zeros zeros_of(const plant::PlantConfig& config) {
  plant::Plant plant(config);
  Zeros zeros{};
  for (int k = 0; k < kZeroSamples; ++k) {
    const auto raw = plant.step({});
    for (std::size_t x = 0; x < 3; ++x) zeros[x] += raw.i[x], zeros[3 + x] += raw.v[x];
  }
  for (double& zero : zeros) zero /= kZeroSamples;
  return zeros;
}

// What sensors count, with noise of another flavour on top where the plant has none.
class Counts {
 public:
  Counts(const NoiseFlavour& flavour, const Machine& m, const plant::SensorScale& scale, std::uint64_t seed)
      : own_(flavour.own()) {
    const double share = std::sqrt(1.0 - flavour.white_share() * flavour.white_share());
    current_ = share * m.current_noise_A / scale.current_A_per_count;
    voltage_ = share * m.voltage_noise_V / scale.voltage_V_per_count;
    for (std::uint64_t n = 0; n < 6; ++n) channels_.emplace_back(flavour, 6 * seed + n);
  }
  double current(std::int16_t count, std::size_t phase) { return with(count, current_, phase); }
  double voltage(std::int16_t count, std::size_t phase) { return with(count, voltage_, 3 + phase); }

 private:
  double with(std::int16_t count, double sigma, std::size_t channel) {
    return own_ ? std::round(count + sigma * channels_[channel].next()) : count;
  }
  bool own_;
  double current_ = 0.0, voltage_ = 0.0;  // counts
  std::vector<FlavouredNoise> channels_;
};

// Runs a profile; `late` moves the noise's stream, which starts anew with every plant.
TimeSeries run(plant::PlantConfig config, const Profile& profile, const Zeros& zeros, bool commanded,
               const Flaw& flaw, int thin, std::size_t late, const Machine& m, const NoiseFlavour& flavour) {
  config.mechanics.held_speed_rpm = rpm_of_rad_s(profile.speed_rad_s);
  plant::Plant plant(config);
  const plant::SensorScale scale = plant.scale();
  for (std::size_t k = 0; k < late; ++k) plant.step({});
  Counts sensed(flavour, m, scale, late + 1000003 * config.seed);
  const auto before = static_cast<std::size_t>(profile.settle_s / kStep_s);
  const auto length = static_cast<std::size_t>(profile.length_s / kStep_s);
  TimeSeries series;
  series.sample_time_s = kStep_s * thin;
  series.voltage_filter_s = commanded ? 0.0 : kFilter_s;
  std::vector<std::int32_t> counts;
  for (std::size_t k = 0; k < before + length; ++k) {
    const double t = kStep_s * static_cast<double>(k);
    const auto v = phases(asked(profile, t + 0.5 * kStep_s));
    const auto raw = plant.step({{v[0], v[1], v[2]}, true});
    if (k < before) continue;
    std::array<double, 6> x{};
    for (std::size_t p = 0; p < 3; ++p)
      x[p] = sensed.current(raw.i[p], p) - zeros[p], x[3 + p] = sensed.voltage(raw.v[p], p) - zeros[3 + p];
    counts.push_back(raw.encoder);
    if ((k - before) % static_cast<std::size_t>(thin) != 0) continue;
    series.i.push_back(scale.current_A_per_count * space_vector(x[0], x[1], x[2]));
    series.v.push_back(commanded ? asked(profile, t + kStep_s)
                                 : scale.voltage_V_per_count * space_vector(x[3], x[4], x[5]));
    series.stator_C.push_back(static_cast<double>(raw.stator_C));
    // The drive that holds the shaft takes what the motor's own losses leave.
    series.torque_Nm.push_back(plant.state().torque_Nm - plant.state().drag_Nm);
  }
  const auto speed =
      speed_from_counts(unwrap_counts(counts), 0, counts.size(), kStep_s, scale.encoder_counts_per_rev);
  for (std::size_t k = 0; k < speed.size(); k += static_cast<std::size_t>(thin))
    series.speed_rad_s.push_back(speed[k] * (1.0 + flaw.speed_gain));
  return series;
}

double component(double phase_noise, double per_count) {
  return std::sqrt(2.0 / 3.0 * (phase_noise * phase_noise + per_count * per_count / 12.0));
}

Noise noise_of(const Machine& m, double range, bool commanded) {
  constexpr double kHalf = 2048.0;  // counts, 12 bits
  Noise noise;
  noise.current_A = component(m.current_noise_A, range * m.current_range_A / kHalf);
  noise.voltage_V = commanded ? 1e-5 * m.v_V : component(m.voltage_noise_V, m.voltage_range_V / kHalf);
  noise.speed_rad_s = speed_noise_rad_s(kStep_s, plant::SensorsConfig{}.encoder_counts_per_rev);
  return noise;
}

Seal seal_of(const Cell& cell, Strength strength, std::uint64_t seed) {
  Seal seal;
  seal.cell = cell.name, seal.strength = strength, seal.seed = seed;
  seal.machine = draw_machine(seed);
  seal.machine.current_noise_A *= cell.noise.scale, seal.machine.voltage_noise_V *= cell.noise.scale;
  seal.hidden = hidden_in(cell, seed);
  seal.outside = cell.removed || !cell.other_machine.empty();
  seal.exact = cell.other_machine.empty();
  for (const std::string& name : seal.hidden) {
    const Kind& k = kind(name);
    seal.outside = seal.outside || k.truth.empty();
    seal.exact = seal.exact && k.exact;
    if (!k.truth.empty()) seal.truth.push_back(k.truth);
  }
  return seal;
}

// A plant with something hidden in it, and what it takes to have records of it.
class Bench {
 public:
  Bench(const Cell& cell, const Seal& seal, const SealOptions& options)
      : cell_(cell), seal_(seal), options_(options) {
    commanded_ = cell.name == "nothing_commanded" ||
                 std::any_of(seal.hidden.begin(), seal.hidden.end(),
                             [](const std::string& h) { return kind(h).commanded; });
    Flaw at_rest;
    range_ = at_rest.current_range = flaw(0.0).current_range;
    zeros_ = zeros_of(config(at_rest));
    torque_ = cell.torque || std::any_of(seal.hidden.begin(), seal.hidden.end(),
                                         [](const std::string& h) { return kind(h).torque; });
    std::mt19937_64 bits(seal.seed * 0x9e3779b97f4a7c15ull + 11);
    std::normal_distribution<double> draw;
    torque_gain_ = 1.0 + kTorqueGain * draw(bits);
    torque_zero_Nm_ = kTorqueZero * seal.machine.torque_Nm() * draw(bits);
  }
  bool commanded() const { return commanded_; }
  Noise noise() const {
    Noise out = noise_of(seal_.machine, range_, commanded_);
    if (torque_) out.torque_Nm = kTorqueNoise * seal_.machine.torque_Nm();
    return out;
  }

  Record record(std::size_t n, const Profile& drive, double warmth) const {
    Record out;
    out.id = fmt::format("r{}", n);
    out.kind = drive.dc ? RecordKind::kDc : RecordKind::kStep;
    const Flaw hidden = flaw(warmth);
    out.series = run(config(hidden), drive, zeros_, commanded_, hidden, options_.thin, 173 * n, seal_.machine,
                     cell_.noise);
    if (!torque_) out.series.torque_Nm.clear();
    add_transducer(out.series, 977 * seal_.seed + n);
    return out;
  }

 private:
  Flaw flaw(double warmth) const {
    Flaw out;
    for (const std::string& name : seal_.hidden) add_flaw(seal_.machine, name, seal_.strength, warmth, out);
    return out;
  }
  plant::PlantConfig config(const Flaw& flaw) const {
    Machine m = seal_.machine;
    m.current_noise_A *= cell_.noise.white_share(), m.voltage_noise_V *= cell_.noise.white_share();
    return plant::parse_plant_config(
        plant_toml(m, seal_.seed, flaw.inverter,
                   flaw.current_range * m.current_range_A, kFilter_s + flaw.extra_lag_s,
                   flaw.sensors, flaw.effects.find("rotor_skin_effect") == std::string::npos) +
            flaw.effects,
        "hidden");
  }

  // What it shows of the shaft's torque.
  void add_transducer(TimeSeries& series, std::uint64_t seed) const {
    std::mt19937_64 bits(seed * 0xbf58476d1ce4e5b9ull + 1);
    std::normal_distribution<double> draw(torque_zero_Nm_, kTorqueNoise * seal_.machine.torque_Nm());
    for (double& torque : series.torque_Nm) torque = torque_gain_ * torque + draw(bits);
  }

  const Cell& cell_;
  const Seal& seal_;
  const SealOptions& options_;
  bool commanded_ = false, torque_ = false;
  double torque_gain_ = 1.0, torque_zero_Nm_ = 0.0;
  double range_ = 1.0;
  Zeros zeros_{};
};

// No induction motor: frequency x flux x load angle, and at rest.
void add_other_machine(const Cell& cell, const SealOptions& options, Sealed& out) {
  const Machine& m = out.seal.machine;
  const OtherMachine other = other_machine(cell.other_machine, m);
  const auto add = [&](double share_of_f, double flux, double load, bool locked) {
    const std::size_t n = out.data.records.size();
    out.data.records.push_back(other_record(other, m, share_of_f * m.f_Hz, flux, load, locked, out.data.noise,
                                            kStep_s * options.thin, options.record_s, 977 * out.seal.seed + n));
    out.data.records.back().id = fmt::format("r{}", n);
    out.data.records.back().holdout = n % 6 == 5;
  };
  for (const double f : {0.33, 0.67, 1.0}) {
    for (const double flux : {0.8, 0.95, 1.1}) {
      for (const double load : {0.05, 0.3, 0.6}) add(f, flux, load, false);
    }
  }
  for (const double f : {0.33, 0.5, 0.67, 0.83, 1.0}) add(f, 1.0, 0.2 * f, true);
}

}  // namespace

Sealed make_sealed(const Cell& cell, Strength strength, std::uint64_t seed, const SealOptions& options) {
  Sealed out{{}, seal_of(cell, strength, seed)};
  const Machine& m = out.seal.machine;
  std::mt19937_64 bits(seed * 0xd1b54a32d192ed03ull + 5);
  std::vector<Profile> drives = profiles(m, options.record_s, options.poor, bits);
  std::shuffle(drives.begin(), drives.end(), bits);
  const auto dc = dc_profiles(m);
  drives.insert(drives.begin(), dc.begin(), dc.end());

  const Bench bench(cell, out.seal, options);
  DataSet& data = out.data;
  data.name = "bench";
  data.pole_pairs = m.pole_pairs;
  data.accuracy = {kGain, bench.commanded() ? 0.0 : kGain};
  data.noise = bench.noise();
  if (!cell.other_machine.empty()) {
    add_other_machine(cell, options, out);
    return out;
  }
  for (std::size_t n = 0; n < drives.size(); ++n) {
    const double warmth = drives[n].dc ? 0.0 : uniform(bits, 0.0, 1.0);
    data.records.push_back(bench.record(n, drives[n], warmth));
    data.records.back().holdout = !drives[n].dc && !drives[n].edge && n % 6 == 5;
  }
  if (!options.poor) {
    for (const Profile& drive : held_out_profiles(m, options, bits)) {
      const double warmth = uniform(bits, 0.0, 1.0);
      data.records.push_back(bench.record(data.records.size(), drive, warmth));
      data.records.back().holdout = true;
    }
  }
  data.noise.current_A *= cell.noise.declared, data.noise.voltage_V *= cell.noise.declared;
  return out;
}

void take_more(const Cell& cell, const std::vector<Wanted>& wanted, Sealed& sealed,
               const SealOptions& options) {
  const Bench bench(cell, sealed.seal, options);
  const Machine& m = sealed.seal.machine;
  for (const Wanted& w : wanted) {
    Profile drive{w.f_Hz,      w.v_V,     w.step, 2.0 * kPi * w.f_Hz * (1.0 - w.slip) / m.pole_pairs,
                  settle_s(m), w.length_s};
    drive.axis = w.axis;
    sealed.data.records.push_back(bench.record(sealed.data.records.size(), drive, w.warmth));
  }
}

}  // namespace imrig::bench
