#include "plant/plant.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "plant/drive.h"
#include "plant/excitation_supply.h"
#include "plant/freewheel.h"
#include "plant/integrator.h"
#include "plant/inverter.h"
#include "plant/plant_config.h"
#include "plant/powers.h"
#include "plant/sensors.h"
#include "plant/voltage_filter.h"

namespace imrig::plant {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

const PlantConfig& checked(const PlantConfig& config) {
  validate(config);
  return config;
}

bool usable(const InverterCommand& command) {
  return command.gates_on && std::isfinite(command.v[0]) && std::isfinite(command.v[1]) &&
         std::isfinite(command.v[2]);
}

}  // namespace

struct Plant::Parts {
  PlantConfig config;
  double sample_s;
  Drive drive;
  std::unique_ptr<Integrator> integrator;
  Freewheel freewheel;
  VoltageFilter filter;
  ExcitationSupply supply;
  Sensors sensors;
  State x;
  std::int64_t index = 0;
  std::int64_t turns = 0;
  std::int64_t supply_period;  // in samples
  bool gates_on = false;
  bool fresh = true;  // as in Integrator
  Observed observed;
  Drive::Flow flow;

  explicit Parts(const PlantConfig& c)
      : config(checked(c)),
        sample_s(seconds(c.sample_time_ns)),
        drive(config),
        integrator(make_integrator(config.integrator, drive)),
        freewheel(config.inverter.dc_link_V, drive, *integrator),
        filter(config.sensors.voltage_filter_s),
        supply(config.supply),
        sensors(config.sensors, config.seed),
        x(drive.initial()),
        supply_period(config.pwm_time_ns / config.sample_time_ns) {
    freewheel.take_over(x);
    drive.terminals = freewheel.bridge().terminals();
    observe();
  }

  void excite();
  void drive_with(SpaceVector asked_V);
  void run_down();
  void count_turns();
  void observe();
  RawSample sample();
};

void Plant::Parts::excite() {
  if (index % supply_period != 0) return;
  const double before = drive.field_V;
  drive.field_V = supply.update(flow.generator.i_f, seconds(config.sample_time_ns * supply_period));
  fresh = fresh || drive.field_V != before;
}

void Plant::Parts::drive_with(SpaceVector asked_V) {
  const Terminals held{Terminals::Kind::kInverter, averaged_inverter(asked_V, config.inverter.dc_link_V),
                       1.0};
  fresh = fresh || !gates_on || drive.terminals.v_s != held.v_s;
  gates_on = true;
  drive.terminals = held;
  // Only an effect can make the voltage move within the step.
  const bool moves = !drive.effects().applied_voltage().empty();
  const SpaceVector start = moves ? drive.flow(x).at.v_s : held.v_s;
  integrator->advance(x, sample_s, fresh);
  filter.advance(start, moves ? drive.flow(x).at.v_s : held.v_s, sample_s);
}

void Plant::Parts::run_down() {
  if (gates_on) freewheel.take_over(x);
  freewheel.advance(x, sample_s, filter, fresh || gates_on);
  gates_on = false;
}

// Whole turns are counted apart, so that the angle keeps its resolution for ever. Both integrators are left
// undisturbed most of the time.
void Plant::Parts::count_turns() {
  fresh = false;
  if (x[kAngle] >= 0.0 && x[kAngle] < kTurn) return;
  const double whole = std::floor(x[kAngle] / kTurn);
  x[kAngle] = std::clamp(x[kAngle] - whole * kTurn, 0.0, std::nextafter(kTurn, 0.0));
  turns += static_cast<std::int64_t>(whole);
  fresh = true;
}

void Plant::Parts::observe() {
  flow = drive.flow(x);
  const Conditions& at = flow.at;
  observed.index = index;
  observed.v_s = at.v_s;
  observed.i_s = at.i.s, observed.i_r = at.i.r;
  observed.psi_s = at.psi_s, observed.psi_r = at.psi_r;
  observed.torque_Nm = at.torque_Nm;
  observed.load_Nm = -flow.generator.shaft_Nm;
  observed.drag_Nm = at.drag_Nm;
  observed.rotor_C = at.temperature.rotor_C, observed.iron_C = at.temperature.iron_C;
  observed.w_mech_rad_s = at.w_mech;
  observed.speed_rpm = rpm_of_rad_s(at.w_mech);
  observed.angle_rad = at.angle;
  observed.turns = turns;
  observed.generator_i_d_A = flow.generator.i_d, observed.generator_i_q_A = flow.generator.i_q;
  observed.field_A = flow.generator.i_f, observed.field_V = drive.field_V;
}

RawSample Plant::Parts::sample() {
  const auto i = phases(observed.i_s);
  const auto v = phases(filter.output());
  Measured values{{i[0], i[1], i[2]}, {v[0], v[1], v[2]}, observed.angle_rad, config.sensors.stator_C};
  for (const auto& slot : drive.effects().measured())
    slot.effect->measured(flow.at, drive.own(x, slot), values);
  observed.stator_C = values.stator_C;
  return sensors.sample(values, turns);
}

Plant::Plant(const PlantConfig& config) : parts_(std::make_unique<Parts>(config)) {}
Plant::~Plant() = default;
Plant::Plant(Plant&&) noexcept = default;
Plant& Plant::operator=(Plant&&) noexcept = default;

RawSample Plant::step(const InverterCommand& command) {
  Parts& p = *parts_;
  p.excite();
  if (usable(command)) {
    p.drive_with(space_vector(command.v[0], command.v[1], command.v[2]));
  } else {
    p.run_down();
  }
  p.count_turns();
  ++p.index;
  p.observe();
  return p.sample();
}

void Plant::set_excitation(const ExcitationCommand& command) { parts_->supply.set(command); }
ExcitationReadback Plant::excitation() const { return parts_->supply.readback(); }
const Observed& Plant::state() const { return parts_->observed; }
SensorScale Plant::scale() const { return parts_->sensors.scale(); }
std::int64_t Plant::index() const { return parts_->index; }
std::int64_t Plant::sample_time_ns() const { return parts_->config.sample_time_ns; }
std::int64_t Plant::pwm_time_ns() const { return parts_->config.pwm_time_ns; }

Powers Plant::powers() const {
  const Drive::Flow& flow = parts_->flow;
  const Conditions& at = flow.at;
  const Generator::Flow& g = flow.generator;
  const GeneratorConfig& box = parts_->config.generator;
  const double armature_A2 = 1.5 * (g.i_d * g.i_d + g.i_q * g.i_q);
  Powers p;
  p.motor_W = power_W(at.v_s, at.i.s);
  const Losses heat = parts_->drive.losses(at, parts_->x);
  p.stator_copper_W = heat.stator_copper_W;
  p.rotor_copper_W = heat.rotor_copper_W;
  p.iron_W = heat.iron_W;
  p.stray_W = heat.stray_W;
  p.air_gap_shaft_W = at.torque_Nm * at.w_mech;
  p.drag_W = at.drag_Nm * at.w_mech;
  p.generator_shaft_W = -g.shaft_Nm * at.coupling.w_generator;
  p.field_W = parts_->drive.field_V * g.i_f;
  p.field_copper_W = box.R_field_ohm * g.i_f * g.i_f;
  p.armature_W = box.R_a_ohm * armature_A2;
  p.load_W = box.R_load_ohm * armature_A2;
  p.magnetic_J = parts_->drive.magnetic_J(at, parts_->x);
  p.kinetic_J = 0.5 * parts_->config.mechanics.J_kgm2 * at.w_mech * at.w_mech;
  p.generator_J = 0.75 * (at.psi_d * g.i_d + at.psi_q * g.i_q) + 0.5 * at.psi_f * g.i_f;
  return p;
}

}  // namespace imrig::plant
