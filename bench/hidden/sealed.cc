#include "bench/hidden/sealed.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include "plant/plant.h"
#include "plant/plant_config.h"
#include "rig/base/space_vector.h"
#include "rig/bus/speed_from_counts.h"

namespace imrig::bench {
namespace {

constexpr double kStep_s = 60e-6, kFilter_s = 160e-6, kRamp_s = 6e-3;
constexpr double kGain = 0.001;  // declared and drawn: SensorsConfig::gain_sigma
constexpr int kZeroSamples = 4000;

// One record's drive.
struct Profile {
  double f_Hz = 0.0, v_V = 0.0, step = 0.0, speed_rad_s = 0.0;
  double settle_s = 0.0, length_s = 0.0;
  bool dc = false;
};

double smooth(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

SpaceVector asked(const Profile& p, double t) {
  if (p.dc) return p.v_V;
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
std::vector<Profile> profiles(const Machine& m, double length_s, std::mt19937_64& bits) {
  std::vector<Profile> all;
  const auto add = [&](double f_Hz, double w_slip, double psi_Wb) {
    const double w = 2.0 * kPi * f_Hz;
    const Steady at = steady(m, w, w_slip, psi_Wb);
    const double step = 0.1 + 0.1 * static_cast<double>(bits() >> 11) * 0x1p-53;
    if (at.v_V * (1.0 + step) > 1.25 * m.v_V || at.i_A > 3.1 * m.i_A) return;
    all.push_back({f_Hz, at.v_V, step, (w - w_slip) / m.pole_pairs, settle_s(m), length_s, false});
  };
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

// Runs a profile; `late` moves the noise's stream, which starts anew with every plant.
TimeSeries run(plant::PlantConfig config, const Profile& profile, const Zeros& zeros, bool commanded,
               const Flaw& flaw, int thin, std::size_t late) {
  config.mechanics.held_speed_rpm = rpm_of_rad_s(profile.speed_rad_s);
  plant::Plant plant(config);
  const plant::SensorScale scale = plant.scale();
  for (std::size_t k = 0; k < late; ++k) plant.step({});
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
    counts.push_back(raw.encoder);
    if ((k - before) % static_cast<std::size_t>(thin) != 0) continue;
    const auto& z = zeros;
    series.i.push_back(scale.current_A_per_count *
                       space_vector(raw.i[0] - z[0], raw.i[1] - z[1], raw.i[2] - z[2]));
    series.v.push_back(commanded ? asked(profile, t + kStep_s)
                                 : scale.voltage_V_per_count *
                                       space_vector(raw.v[0] - z[3], raw.v[1] - z[4], raw.v[2] - z[5]));
    series.stator_C.push_back(static_cast<double>(raw.stator_C));
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
  Seal seal{cell.name, strength, seed, {}, false, draw_machine(seed)};
  for (const std::string& name : cell.hidden) {
    const Kind& k = kind(name);
    if (k.truth.empty())
      seal.outside = true;
    else
      seal.truth.push_back(k.truth);
  }
  return seal;
}

}  // namespace

Sealed make_sealed(const Cell& cell, Strength strength, std::uint64_t seed, const SealOptions& options) {
  Sealed out{{}, seal_of(cell, strength, seed)};
  const Machine& m = out.seal.machine;
  const bool commanded =
      cell.name == "nothing_commanded" || std::any_of(cell.hidden.begin(), cell.hidden.end(),
                                                      [](const std::string& h) { return kind(h).commanded; });
  std::mt19937_64 bits(seed * 0xd1b54a32d192ed03ull + 5);
  std::vector<Profile> drives = profiles(m, options.record_s, bits);
  std::shuffle(drives.begin(), drives.end(), bits);
  const auto dc = dc_profiles(m);
  drives.insert(drives.begin(), dc.begin(), dc.end());

  const auto config = [&](const Flaw& flaw) {
    return plant::parse_plant_config(
        plant_toml(m, seed, flaw.inverter, flaw.current_range * m.current_range_A,
                   kFilter_s + flaw.extra_lag_s, flaw.sensors,
                   flaw.effects.find("rotor_skin_effect") == std::string::npos) +
            flaw.effects,
        "hidden");
  };
  DataSet& data = out.data;
  data.name = "bench";
  data.pole_pairs = m.pole_pairs;
  data.accuracy = {kGain, kGain};
  Zeros zeros{};
  for (std::size_t n = 0; n < drives.size(); ++n) {
    Flaw flaw;
    const double warmth = drives[n].dc ? 0.0 : static_cast<double>(bits() >> 11) * 0x1p-53;
    for (const std::string& name : cell.hidden) add_flaw(m, name, strength, warmth, flaw);
    if (n == 0) {
      Flaw at_rest;
      at_rest.current_range = flaw.current_range;
      zeros = zeros_of(config(at_rest));
      data.noise = noise_of(m, flaw.current_range, commanded);
    }
    Record record;
    record.id = fmt::format("r{}", n);
    record.kind = drives[n].dc ? RecordKind::kDc : RecordKind::kStep;
    record.holdout = !drives[n].dc && n % 6 == 5;
    record.series = run(config(flaw), drives[n], zeros, commanded, flaw, options.thin, 173 * n);
    data.records.push_back(std::move(record));
  }
  return out;
}

}  // namespace imrig::bench
