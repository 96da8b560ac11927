// Speed of the plant alone, on one core: plant_rtf_averaged, plant_rtf_switching, plant_vs_rk4.
// usage: imrig-bench-plant [--json] --models DIR NAME...

#include <cmath>
#include <filesystem>
#include <memory>

#include "bench/bare_full_motor.h"
#include "bench/bare_motor.h"
#include "bench/one_core.h"
#include "bench/result.h"
#include "plant/effects/friction.h"
#include "plant/integrator.h"
#include "plant/plant.h"
#include "plant/sticking_integrator.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/space_vector.h"

namespace imrig::bench {
namespace {

using namespace plant;

constexpr int kRepeats = 5;
constexpr double kSimulated_s = 3.0;  // start from rest, load from 1 s on, a 10 % step at 2 s

SpaceVector asked(double t) {
  const double amplitude = (t > 2.0 ? 161.6 : 179.6) * std::min(1.0, t / 0.2);
  return std::polar(amplitude, 2.0 * kPi * 60.0 * t);
}

void drive(Plant& plant) {
  const double h = 1e-9 * static_cast<double>(plant.sample_time_ns());
  const auto steps = std::llround(kSimulated_s / h);
  const auto load_at = std::llround(1.0 / h);
  InverterCommand held;
  for (long long k = 0; k < steps; ++k) {
    if (k == load_at) plant.set_excitation({60.0, 1.2, true, 0.0, 0.0});
    if (k % 4 == 0) {
      const auto v = phases(asked(static_cast<double>(k + 2) * h));
      held = {{v[0], v[1], v[2]}, true};
    }
    plant.step(held);
  }
}

std::string plant_file(const std::string& models) {
  const std::string full = models + "/proca_5hp_full.toml";
  return std::filesystem::exists(full) ? full : models + "/proca_5hp.toml";
}

std::string of_effects(const PlantConfig& config) {
  std::string names;
  for (const auto& effect : config.effects) names.append(names.empty() ? "" : " ").append(effect->name());
  return names.empty() ? "none" : names;
}

Result measure(const std::string& name, const PlantConfig& config, double target, int repeats = kRepeats) {
  double end_rpm = 0.0;
  std::vector<double> rtf;
  for (const double s : timed(repeats, [&] {
         Plant plant(config);
         drive(plant);
         end_rpm = plant.state().speed_rpm;
       }))
    rtf.push_back(kSimulated_s / s);
  const Spread got = spread(rtf);
  return {name,   got.median, "x real time", target, true,
          fmt::format("{}, {}, {:.0f} us samples, effects: {}; median of {}, {:.0f} to {:.0f}; ends at {:.0f} rpm", config.name,
                      config.integrator.kind == IntegratorConfig::Kind::kRk4 ? "RK4" : "ERKStep",
                      1e-3 * static_cast<double>(config.sample_time_ns), of_effects(config), repeats, got.least,
                      got.most, end_rpm)};
}

Result averaged(const std::string& models) {
  PlantConfig config = load_plant_config(plant_file(models));
  config.integrator.kind = IntegratorConfig::Kind::kRk4;
  Result result = measure("plant_rtf_averaged", config, 100.0);
  config.integrator.kind = IntegratorConfig::Kind::kSundials;
  result.note += fmt::format("; ERKStep {:.0f}", measure("", config, 0.0, 1).value);
  return result;
}

Result switching(const std::string& models) {
  const std::string path = plant_file(models);
  std::string text = read_text(path);
  const std::string table = "[inverter]\n";
  const auto at = text.find(table);
  if (at == std::string::npos) throw Error(path, "has no [inverter]");
  if (text.find("kind = \"switching\"") == std::string::npos) text.insert(at + table.size(), "kind = \"switching\"\n");
  PlantConfig config = parse_plant_config(text, path);
  config.integrator.kind = IntegratorConfig::Kind::kRk4;
  return measure("plant_rtf_switching", config, 25.0);
}

// One way to run the same 3 s: v_s held over four samples, the field's voltage constant.
struct Trace {
  std::vector<SpaceVector> i;
  std::vector<double> rpm;
};

constexpr double kField_V = 24.7;
constexpr double kSample_s = 60e-6;
constexpr int kSteps = 50000;
constexpr Friction::Config kFriction{0.25, 0.0015};

PlantConfig base_machine() {
  PlantConfig config;
  config.machine = machine_of_inverse_gamma(0.39, 0.22, 0.006, 0.068, 2);
  config.sensors.ideal = true;
  config.effects.push_back(std::make_shared<Friction>(kFriction));
  return config;
}

Trace by_drive(const PlantConfig& config, bool keep) {
  Drive drive(config);
  const auto integrator = with_sticking(make_integrator(config.integrator, drive), drive);
  State x = drive.initial();
  drive.field_V = kField_V;
  Trace trace;
  for (int k = 0; k < kSteps; ++k) {
    if (k % 4 == 0) drive.terminals = {Terminals::Kind::kInverter, asked((k + 2) * kSample_s), 1.0};
    integrator->advance(x, kSample_s, k % 4 == 0);
    if (keep) trace.i.push_back(drive.stator_current(x)), trace.rpm.push_back(rpm_of_rad_s(x[kSpeed]));
  }
  return trace;
}

template <class Motor>
Trace by_bare_rk4(Motor motor, bool keep) {
  auto x = motor.at_rest();
  motor.field_V = kField_V;
  Trace trace;
  for (int k = 0; k < kSteps; ++k) {
    if (k % 4 == 0) motor.v_s = asked((k + 2) * kSample_s);
    motor.step(x, kSample_s);
    if (keep) trace.i.push_back(motor.current(x)), trace.rpm.push_back(rpm_of_rad_s(x[4]));
  }
  if (!(std::abs(x[4]) < 1e3)) throw Error("plant_vs_rk4", "the bare motor ran away");
  return trace;
}

std::string apart(const Trace& a, const Trace& b) {
  double square = 0.0, rpm = 0.0;
  for (std::size_t k = 0; k < a.i.size(); ++k) {
    square += std::norm(a.i[k] - b.i[k]);
    rpm = std::max(rpm, std::abs(a.rpm[k] - b.rpm[k]));
  }
  return fmt::format("{:.1e} A rms {:.1e} rpm", std::sqrt(square / static_cast<double>(a.i.size())), rpm);
}

// In turn, so that a slow moment hits both.
template <class Motor>
Result compared(const std::string& name, PlantConfig config, const Motor& bare, double rtol) {
  std::vector<double> ratio, bare_s, plant_s;
  config.integrator = {IntegratorConfig::Kind::kRk4, 0.0, 0.0};
  for (int k = 0; k < 2 * kRepeats + 1; ++k) {
    bare_s.push_back(timed(1, [&] { by_bare_rk4(bare, false); })[0]);
    plant_s.push_back(timed(1, [&] { by_drive(config, false); })[0]);
    ratio.push_back(plant_s.back() / bare_s.back());
  }
  const Trace fixed = by_drive(config, true);
  config.integrator = {IntegratorConfig::Kind::kSundials, rtol, 0.01 * rtol};
  const Trace reference = by_drive(config, true);
  const Spread got = spread(ratio);
  return {name, got.median, "x bare RK4", 2.0, false,
          fmt::format("{:.2f} to {:.2f}; effects: {}; a step {:.0f} ns, bare {:.0f} ns; from SUNDIALS at {:.0e}: plant {}, bare {}",
                      got.least, got.most, of_effects(config), 1e9 / kSteps * spread(plant_s).median,
                      1e9 / kSteps * spread(bare_s).median, rtol, apart(fixed, reference), apart(by_bare_rk4(bare, true), reference))};
}

Result against_bare_full(const std::string& models) {
  const PlantConfig full = load_plant_config(models + "/proca_5hp_full.toml");
  return compared("plant_vs_rk4", full, BareFullMotor(bare_full_config(full)), 1e-10);
}

Result against_bare_plain() {
  const PlantConfig plain = base_machine();
  return compared("plant_vs_rk4_plain", plain, BareMotor(plain, {kFriction.coulomb_Nm, kFriction.viscous_Nms}), 1e-12);
}

int body(int argc, char** argv) {
  bool json = false;
  std::string models = "models/plants";
  std::vector<std::string> names;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--json") json = true;
    else if (word == "--models" && k + 1 < argc) models = argv[++k];
    else names.push_back(word);
  }
  pin_to_one_core();
  for (const std::string& name : names) {
    if (name == "plant_rtf_averaged") print(averaged(models), json);
    else if (name == "plant_rtf_switching") print(switching(models), json);
    else if (name == "plant_vs_rk4") print(against_bare_full(models), json), print(against_bare_plain(), json);
    else throw Error("usage", "no benchmark is called " + name);
  }
  return 0;
}

}  // namespace
}  // namespace imrig::bench

int main(int argc, char** argv) { return imrig::run_main("imrig-bench-plant", imrig::bench::body, argc, argv); }
