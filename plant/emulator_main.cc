// The process imrig-emulator: plant, DSP firmware, DSP link and Modbus server in one. It stands in for the
// bench at its two wires and speaks no LCM.
//   imrig-emulator --config plant.toml [--link URL] [--modbus URL] [--pace realtime|N|max] [--seed N]
//                  [--integrator rk4|sundials]
//   imrig-emulator truth --config plant.toml [--at f_Hz=60,v_V=180,slip=0.03] [--seed N] [--json]

#include <cstdio>
#include <optional>

#include "plant/emulator/emulator.h"
#include "plant/modbus_server.h"
#include "plant/operating_point.h"
#include "plant/plant_config.h"
#include "plant/truth.h"
#include "rig/base/clock.h"
#include "rig/base/command_line.h"
#include "rig/base/error.h"
#include "rig/base/stop_signal.h"

namespace imrig::plant {
namespace {

struct Options {
  std::string config;
  std::string link = "udp://127.0.0.1:47010";
  std::string modbus = "tcp://127.0.0.1:15020";
  std::string pace = "realtime";
  std::optional<std::uint64_t> seed;
  std::string integrator;  // empty: the configuration's
  bool json = false;
  std::string at;
};

PlantConfig configuration(const Options& options) {
  PlantConfig config = load_plant_config(options.config);
  if (options.seed) config.seed = *options.seed;
  if (options.integrator == "rk4") config.integrator.kind = IntegratorConfig::Kind::kRk4;
  if (options.integrator == "sundials") config.integrator.kind = IntegratorConfig::Kind::kSundials;
  return config;
}

int tell_truth(const Options& options) {
  const PlantConfig config = configuration(options);
  std::string told;
  if (options.at.empty()) {
    told = options.json ? truth_json(config) : truth_text(config);
  } else {
    const PointRequest at = parse_point_request(options.at);
    told = options.json ? truth_json(config, at) : truth_text(config, at);
  }
  std::printf("%s\n", told.c_str());
  return 0;
}

void run(Emulator& emulator, ModbusServer& modbus) {
  while (!stop_asked()) {
    emulator.set_excitation(modbus.command());
    const std::int64_t rest_us = emulator.turn(monotonic_us());
    modbus.set_readback(emulator.excitation());
    emulator.wait(rest_us);
  }
}

int serve(const Options& options) {
  catch_stop_signals();
  const Pace pace = parse_pace(options.pace);
  Plant plant(configuration(options));
  LinkPort port(options.link);
  ModbusServer modbus(options.modbus);
  const std::string link_url = port.url();
  Emulator emulator(std::move(plant), std::move(port), pace, random_id());
  std::printf("ready link=%s modbus=%s\n", link_url.c_str(), modbus.bound_url().c_str());
  std::fflush(stdout);
  run(emulator, modbus);
  const EmulatorCounters counters = emulator.counters();
  if (counters.missed_deadlines > 0) {
    std::fprintf(stderr, "imrig-emulator: began late %lld times (more than %lld ms)\n",
                 static_cast<long long>(counters.missed_deadlines),
                 static_cast<long long>(Emulator::kLate_us / 1000));
  }
  return 0;
}

int body(int argc, char** argv) {
  CLI::App app{"The emulated bench: motor, load generator, inverter, DSP, sensors and excitation supply."};
  app.name("imrig-emulator");
  Options options;
  CLI::App* truth = app.add_subcommand("truth", "print what an ideal identification would find");
  truth->add_flag("--json", options.json, "as JSON");
  truth->add_option("--at", options.at,
                    "also at an operating point: f_Hz=60,v_V=180,slip=0.03 or load_Nm=..; stator_C=, rotor_C=");
  for (CLI::App* with_plant : {&app, truth}) {
    with_plant->add_option("--config", options.config, "plant configuration (models/plants/*.toml)");
    with_plant->add_option("--seed", options.seed,
                           "of sensor gains, offsets and noise, not the configuration's");
  }
  app.add_option("--link", options.link, "udp://HOST:PORT or serial:///dev/NAME?baud=NUMBER")
      ->capture_default_str();
  app.add_option("--modbus", options.modbus, "tcp://HOST:PORT or rtu:///dev/NAME?baud=NUMBER&unit=NUMBER")
      ->capture_default_str();
  app.add_option("--pace", options.pace, "realtime, N (times real time) or max (as the host's credits allow)")
      ->capture_default_str();
  app.add_option("--integrator", options.integrator,
                 "rk4 (fixed step, for pace) or sundials (error-controlled), not the configuration's")
      ->check(CLI::IsMember({"rk4", "sundials"}));
  if (const auto done = parse_command_line(app, "imrig-emulator", argc, argv)) return *done;
  if (options.config.empty()) throw Error("usage", "--config is missing", "see imrig-emulator --help");
  return *truth ? tell_truth(options) : serve(options);
}

}  // namespace
}  // namespace imrig::plant

int main(int argc, char** argv) { return imrig::run_main("imrig-emulator", imrig::plant::body, argc, argv); }
