#include "plant/plant.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "plant/dc_link.h"
#include "plant/drive.h"
#include "plant/effects/inverter_dead_time.h"
#include "plant/excitation_supply.h"
#include "plant/freewheel.h"
#include "plant/integrator.h"
#include "plant/inverter.h"
#include "plant/noise.h"
#include "plant/plant_config.h"
#include "plant/powers.h"
#include "plant/sensors.h"
#include "plant/sticking_integrator.h"
#include "plant/switching_inverter.h"
#include "plant/voltage_filter.h"

namespace imrig::plant {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

constexpr double kShortest_s = 1e-12;  // what is left of a step is rounding
constexpr std::uint64_t kJitterStream = 0xd1b54a32d192ed03ull;

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

const PlantConfig& checked(const PlantConfig& config) {
  validate(config);
  return config;
}

bool usable(const InverterCommand& command) {
  return command.gates_on && std::isfinite(command.v[0]) && std::isfinite(command.v[1]) &&
         std::isfinite(command.v[2]);
}

std::int64_t carrier_ns(const PlantConfig& c) {
  return c.inverter.carrier_ns > 0 ? c.inverter.carrier_ns : c.pwm_time_ns;
}

double dead_time_s(const PlantConfig& c) {
  for (const auto& effect : c.effects) {
    if (const auto* dead = dynamic_cast<const InverterDeadTime*>(effect.get())) return dead->dead_time_s();
  }
  return 0.0;
}

}  // namespace

struct Plant::Parts {
  PlantConfig config;
  double clock;  // true seconds in a second of the converters' clock
  double sample_s;
  Drive drive;
  std::unique_ptr<Integrator> integrator;
  Freewheel freewheel;
  DcLink link;
  SwitchingInverter switching;
  VoltageFilter filter;
  ExcitationSupply supply;
  Sensors sensors;
  Noise jitter;
  State x;
  std::int64_t index = 0;
  std::int64_t turns = 0;
  std::int64_t supply_period;  // in samples
  double late_s = 0.0;         // of the last sample, jitter
  double start_late_s = 0.0;   // of the sample before it
  double step_s = 0.0;         // true length of this step
  double drawn_W = 0.0;        // from the link over the last step
  bool gates_on = false;
  bool fresh = true;  // as in Integrator
  Observed observed;
  const Drive::Flow* flow = nullptr;  // at the end of the last step

  explicit Parts(const PlantConfig& c)
      : config(checked(c)),
        clock(1.0 + 1e-6 * c.sensors.clock_ppm),
        sample_s(seconds(c.sample_time_ns) * clock),
        drive(config),
        integrator(with_sticking(make_integrator(config.integrator, drive), drive)),
        freewheel(config.inverter.dc_link_V, drive, *integrator),
        link(config.inverter),
        switching(seconds(carrier_ns(c)) * clock, dead_time_s(c)),
        filter(config.sensors.voltage_filter_s),
        supply(config.supply),
        sensors(config.sensors, config.seed),
        jitter(config.seed ^ kJitterStream),
        x(drive.initial()),
        supply_period(config.pwm_time_ns / config.sample_time_ns) {
    if (switches()) drive.cycle_s = 0.0;
    freewheel.take_over(x);
    drive.terminals = freewheel.bridge().terminals();
    observe();
  }

  bool switches() const { return config.inverter.kind == InverterConfig::Kind::kSwitching; }
  void feed_link();
  double draw_step();
  SpaceVector within_limit(SpaceVector asked_V) const;
  double modulator_V() const {
    return config.inverter.link_compensated ? link.voltage_V() : config.inverter.dc_link_V;
  }
  void advance(SpaceVector v, double duration_s);
  void switch_legs(SpaceVector asked_V);
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
  drive.field_V = supply.update(flow->generator.i_f, seconds(config.sample_time_ns * supply_period));
  fresh = fresh || drive.field_V != before;
}

void Plant::Parts::feed_link() {
  link.step(static_cast<double>(index) * sample_s, sample_s, drawn_W);
  if (link.stiff()) return;
  drive.dc_link_V = link.voltage_V();
  freewheel.set_dc_link_V(drive.dc_link_V);
  fresh = true;
}

// The true length of the step: from one sampling instant, early or late, to the next.
double Plant::Parts::draw_step() {
  const double sigma_s = config.sensors.clock_jitter_s;
  if (sigma_s <= 0.0) return sample_s;
  const double before_s = late_s;
  late_s = std::clamp(sigma_s * jitter.normal(), -0.25 * sample_s, 0.25 * sample_s);
  return sample_s + late_s - before_s;
}

SpaceVector Plant::Parts::within_limit(SpaceVector asked_V) const {
  return config.inverter.limit == InverterConfig::Limit::kHexagon ? within_hexagon(asked_V, modulator_V())
                                                                  : within_circle(asked_V, modulator_V());
}

// A stretch at the inverter's voltage v; only an effect can make it move on the way to the terminals.
void Plant::Parts::advance(SpaceVector v, double duration_s) {
  const Terminals held{Terminals::Kind::kInverter, v, 1.0};
  fresh = fresh || !gates_on || drive.terminals.v_s != held.v_s;
  gates_on = true;
  drive.terminals = held;
  const bool moves = !drive.effects().applied_voltage().empty();
  const SpaceVector start = moves ? integrator->flow(x).at.v_s : held.v_s;
  integrator->advance(x, duration_s, fresh);
  const SpaceVector end = moves ? integrator->flow(x).at.v_s : held.v_s;
  filter.advance(start, end, duration_s);
  observed.v_mean += 0.5 * (start + end) * (duration_s / step_s);
  fresh = false;
}

void Plant::Parts::switch_legs(SpaceVector asked_V) {
  if (!gates_on) switching.release();
  const auto into_ns = index * config.sample_time_ns % carrier_ns(config);
  switching.anchor(seconds(into_ns) * clock + start_late_s);
  for (double left_s = step_s; left_s > kShortest_s;) {
    switching.act(asked_V, modulator_V(), phases(integrator->flow(x).at.i.s));
    const double stretch_s = std::min(left_s, switching.until_next_s());
    if (stretch_s > kShortest_s) advance(switching.voltage(link.voltage_V()), stretch_s);
    switching.pass(stretch_s);
    left_s -= stretch_s;
  }
}

void Plant::Parts::drive_with(SpaceVector asked_V) {
  observed.v_mean = 0.0;
  if (switches()) return switch_legs(within_limit(asked_V));
  advance(within_limit(asked_V) * (link.voltage_V() / modulator_V()), step_s);
}

void Plant::Parts::run_down() {
  if (gates_on) freewheel.take_over(x);
  freewheel.advance(x, step_s, filter, fresh || gates_on);
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
  flow = &integrator->flow(x);
  const Conditions& at = flow->at;
  observed.index = index;
  observed.v_s = at.v_s;
  observed.i_s = at.i.s, observed.i_r = at.i.r;
  observed.psi_s = at.psi_s, observed.psi_r = at.psi_r;
  observed.torque_Nm = at.torque_Nm;
  observed.load_Nm = -flow->generator.shaft_Nm;
  observed.drag_Nm = at.drag_Nm;
  const double through_shaft_Nm = at.coupling.rigid ? -at.generator_Nm : -at.coupling.torque_on_motor_Nm;
  observed.transducer_Nm = config.sensors.torque_gain * through_shaft_Nm + config.sensors.torque_offset_Nm;
  observed.dc_link_V = drive.dc_link_V;
  observed.rotor_C = at.temperature.rotor_C, observed.iron_C = at.temperature.iron_C;
  observed.w_mech_rad_s = at.w_mech;
  observed.speed_rpm = rpm_of_rad_s(at.w_mech);
  observed.angle_rad = at.angle;
  observed.turns = turns;
  observed.generator_i_d_A = flow->generator.i_d, observed.generator_i_q_A = flow->generator.i_q;
  observed.field_A = flow->generator.i_f, observed.field_V = drive.field_V;
}

RawSample Plant::Parts::sample() {
  const auto i = phases(observed.i_s);
  const auto v = phases(filter.output());
  Measured values{{i[0], i[1], i[2]}, {v[0], v[1], v[2]}, observed.angle_rad, config.sensors.stator_C};
  for (const auto& slot : drive.effects().measured())
    slot.effect->measured(flow->at, drive.own(x, slot), values);
  observed.stator_C = values.stator_C;
  return sensors.sample(values, turns);
}

Plant::Plant(const PlantConfig& config) : parts_(std::make_unique<Parts>(config)) {}
Plant::~Plant() = default;
Plant::Plant(Plant&&) noexcept = default;
Plant& Plant::operator=(Plant&&) noexcept = default;

RawSample Plant::step(const InverterCommand& command) {
  Parts& p = *parts_;
  p.feed_link();
  p.excite();
  p.start_late_s = p.late_s;
  p.step_s = p.draw_step();
  const SpaceVector i_before = p.observed.i_s;
  if (usable(command)) {
    p.drive_with(space_vector(command.v[0], command.v[1], command.v[2]));
  } else {
    p.run_down();
  }
  p.count_turns();
  ++p.index;
  p.observe();
  const SpaceVector i_mean = 0.5 * (i_before + p.observed.i_s);
  p.drawn_W = power_W(p.gates_on ? p.observed.v_mean : p.observed.v_s, i_mean);
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
  const Drive::Flow& flow = *parts_->flow;
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
  p.friction_W = heat.friction_W;
  p.air_gap_shaft_W = at.torque_Nm * at.w_mech;
  p.drag_W = at.drag_Nm * at.w_mech;
  p.coupling_W = at.coupling.heat_W;
  p.generator_shaft_W = -g.shaft_Nm * at.coupling.w_generator;
  p.field_W = parts_->drive.field_V * g.i_f;
  p.field_copper_W = box.R_field_ohm * g.i_f * g.i_f;
  p.armature_W = box.R_a_ohm * armature_A2;
  p.generator_core_W = g.core_W;
  p.generator_friction_W = g.friction_W;
  p.load_W = box.R_load_ohm * armature_A2;
  p.magnetic_J = parts_->drive.magnetic_J(at, parts_->x);
  p.kinetic_J = 0.5 * parts_->config.mechanics.J_kgm2 * at.w_mech * at.w_mech;
  p.generator_J = parts_->drive.generator().stored_J(at.psi_d, at.psi_q, at.psi_f, g);
  return p;
}

}  // namespace imrig::plant
