// Walks the whole registry. A new effect is covered by its line there; what the walk needs to know of it, its
// neutral and its strong setting, stands in that line.

#include "plant/effects/registry.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <ostream>
#include <set>

#include "plant/drive.h"
#include "plant/powers.h"
#include "rig/base/config_reader.h"
#include "rig/base/error.h"
#include "tests/plant/bench.h"

namespace imrig::plant {

void PrintTo(const EffectEntry& entry, std::ostream* out) { *out << entry.name; }

namespace {

using namespace bench;
using EffectPtr = std::shared_ptr<const Effect>;

EffectPtr read(const EffectEntry& entry, const std::string& table) {
  const ConfigReader reader = ConfigReader::from_text(table, "[effects." + entry.name + "]");
  EffectPtr effect = entry.read(reader);
  reader.finish();
  return effect;
}

std::string table_of(const std::vector<Parameter>& parameters) {
  std::string table;
  for (const auto& p : parameters) table += fmt::format("{} = {}\n", p.name, fmt::format("{:.17g}", p.value));
  return table;
}

PlantConfig with(EffectPtr effect, IntegratorConfig::Kind kind = IntegratorConfig::Kind::kSundials) {
  PlantConfig c = config();
  c.mechanics.J_kgm2 = 0.02;
  c.integrator.kind = kind;
  if (effect) c.effects = {std::move(effect)};
  return c;
}

// Start-up under load, gates opened, at sensors and inside.
std::vector<double> trace(const PlantConfig& c) {
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  std::vector<double> values;
  for (int k = 0; k < 4000; ++k) {
    const RawSample raw = plant.step(k < 3000 ? Supply{60.0, 150.0}.at(plant) : InverterCommand{});
    const Observed& now = plant.state();
    values.insert(values.end(), {now.i_s.real(), now.i_s.imag(), now.psi_r.real(), now.v_s.real(),
                                 now.speed_rpm, now.torque_Nm, now.load_Nm, now.drag_Nm, now.angle_rad,
                                 plant.powers().magnetic_J, static_cast<double>(raw.i[0]),
                                 static_cast<double>(raw.i[1]), static_cast<double>(raw.v[1]),
                                 static_cast<double>(raw.encoder), static_cast<double>(raw.stator_C)});
  }
  return values;
}

class EveryEffect : public testing::TestWithParam<EffectEntry> {};

TEST(Registry, NamesEachEffectOnce) {
  std::set<std::string> names;
  for (const auto& entry : effect_registry()) {
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_FALSE(entry.physics.empty()) << entry.name;
  }
  EXPECT_GE(names.size(), 4u);
}

TEST_P(EveryEffect, CarriesItsNameAndNamedParametersWithoutRepetition) {
  const EffectPtr effect = read(GetParam(), GetParam().strong);
  EXPECT_EQ(effect->name(), GetParam().name);
  std::set<std::string> names;
  for (const auto& p : effect->parameters()) {
    EXPECT_TRUE(names.insert(p.name).second) << p.name;
    EXPECT_TRUE(std::isfinite(p.value)) << p.name;
  }
  EXPECT_FALSE(names.empty());
}

TEST_P(EveryEffect, ComesBackFromWhatItsParametersSay) {
  ASSERT_FALSE(GetParam().strong.empty()) << "its line in the registry tells no strong setting";
  const EffectPtr effect = read(GetParam(), GetParam().strong);
  const EffectPtr again = read(GetParam(), table_of(effect->parameters()));
  const auto a = effect->parameters(), b = again->parameters();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].name, b[k].name);
    EXPECT_EQ(a[k].value, b[k].value) << a[k].name;
  }
  // They say everything that matters: the same bits.
  EXPECT_EQ(trace(with(effect)), trace(with(again)));
}

TEST_P(EveryEffect, RefusesAParameterThatItDoesNotHave) {
  EXPECT_THROW(read(GetParam(), GetParam().strong + "\nno_such_parameter = 1.0\n"), Error);
}

TEST_P(EveryEffect, LeavesEveryBitOfTheBaseMachineWhenNeutral) {
  for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
    const auto base = trace(with({}, kind));
    EXPECT_EQ(base, trace(with(read(GetParam(), GetParam().neutral), kind)));
    EXPECT_NE(base, trace(with(read(GetParam(), GetParam().strong), kind)));
  }
}

// The last accepted value on the way from `from`, which is accepted, to `to`.
double end_of_range(const EffectEntry& entry, std::vector<Parameter> parameters, std::size_t which,
                    double to) {
  const auto accepts = [&](double value) {
    parameters[which].value = value;
    try {
      read(entry, table_of(parameters));
      return true;
    } catch (const Error&) {
      return false;
    }
  };
  double good = parameters[which].value, bad = to;
  const bool whole = !accepts(good + 1e-3) && !accepts(good - 1e-3);
  if (accepts(bad)) return bad;
  for (int round = 0; round < 80; ++round) {
    const double middle = whole ? std::round(0.5 * (good + bad)) : 0.5 * (good + bad);
    if (middle == good || middle == bad) break;
    (accepts(middle) ? good : bad) = middle;
  }
  return good;
}

void expect_finite(const PlantConfig& c, const std::string& where) {
  std::unique_ptr<Drive> drive;
  try {
    Plant whole(c);
    for (int k = 0; k < 20; ++k) whole.step(Supply{60.0, 150.0}.at(whole));
    EXPECT_TRUE(std::isfinite(std::abs(whole.state().i_s)) && std::isfinite(whole.state().speed_rpm))
        << where;
    drive = std::make_unique<Drive>(c);
  } catch (const Error&) {
    return;  // refused with a sentence: too fast for the sample time
  }
  for (const double psi : {0.0, 1e-9, 0.5, 20.0}) {
    for (const double w : {0.0, 1e-9, 150.0, -3000.0}) {
      for (const double own : {-100.0, 0.0, 100.0}) {
        State x = drive->initial(), dx{};
        x[kPsiS] = psi, x[kPsiS + 1] = -0.3 * psi, x[kPsiR] = 0.6 * psi, x[kPsiR + 1] = psi;
        x[kSpeed] = w, x[kAngle] = 1.0;
        for (std::size_t k = kOwn; k < drive->size(); ++k) x[k] += own;
        for (const auto kind : {Terminals::Kind::kInverter, Terminals::Kind::kOpen}) {
          drive->terminals = {kind, 200.0, 1.0};
          drive->derivatives(x.data(), dx.data());
          for (std::size_t k = 0; k < drive->size(); ++k) {
            ASSERT_TRUE(std::isfinite(dx[k])) << where << ", state " << k << ", psi " << psi << ", w " << w;
          }
          const Drive::Flow flow = drive->flow(x);
          Measured values{{1e3, -1e3, 0.0}, {1e3, -1e3, 0.0}, 6.28, 25.0};
          for (const auto& slot : drive->effects().measured())
            slot.effect->measured(flow.at, drive->own(x, slot), values);
          ASSERT_TRUE(std::isfinite(values.i[0] + values.v[1] + values.encoder_rad + values.stator_C))
              << where;
          ASSERT_TRUE(std::isfinite(drive->magnetic_J(flow.at, x))) << where;
        }
      }
    }
  }
}

TEST_P(EveryEffect, StaysFiniteWithEachParameterAtBothEndsOfItsRange) {
  const auto parameters = read(GetParam(), GetParam().strong)->parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    for (const double to : {-1e12, 1e12}) {
      auto extreme = parameters;
      extreme[k].value = end_of_range(GetParam(), parameters, k, to);
      expect_finite(with(read(GetParam(), table_of(extreme)), IntegratorConfig::Kind::kRk4),
                    fmt::format("{} = {}", extreme[k].name, extreme[k].value));
      if (HasFatalFailure()) return;
    }
  }
}

double heat_W(const Powers& p) {
  return p.stator_copper_W + p.rotor_copper_W + p.iron_W + p.stray_W + p.friction_W;
}

double least_loss_W(const Powers& p) {
  return std::min({p.stator_copper_W, p.rotor_copper_W, p.iron_W, p.stray_W, p.friction_W});
}

// Strong, over a start-up and with the gates open: what went in is heat, motion and magnetism; no loss is
// negative, and with the gates open nothing rises.
TEST_P(EveryEffect, MakesNoEnergy) {
  PlantConfig c = with(read(GetParam(), GetParam().strong), IntegratorConfig::Kind::kRk4);
  c.generator.coupled = false;
  c.sample_time_ns = 20'000;
  Plant plant(c);
  const Supply supply{60.0, 179.6, 0.02};
  const double h = sample_s(plant);
  double in_J = 0.0, heat_J = 0.0;
  Powers last = plant.powers();
  Complex i_last = plant.state().i_s;
  const auto stored_J = [&] { return last.magnetic_J + last.kinetic_J; };
  const double start_J = stored_J();
  const auto step = [&](const InverterCommand& command) {
    plant.step(command);
    const Powers now = plant.powers();
    ASSERT_GE(least_loss_W(now), -1e-9) << plant.index();
    if (command.gates_on) in_J += h * power_W(plant.state().v_s, 0.5 * (plant.state().i_s + i_last));
    heat_J += 0.5 * h * (heat_W(now) + heat_W(last));
    last = now, i_last = plant.state().i_s;
  };
  while (plant.index() < 30000 && !HasFatalFailure()) step(supply.at(plant));
  const double left_J = in_J - heat_J - (stored_J() - start_J);
  std::printf("%s: in %.2f J, heat %.2f, stored %.2f, left over %.1e of it\n", GetParam().name.c_str(), in_J,
              heat_J, stored_J(), left_J / in_J);
  EXPECT_GT(in_J, 500.0);
  EXPECT_LT(std::abs(left_J), 1e-3 * in_J);
  for (int k = 0; k < 5000 && !HasFatalFailure(); ++k) {
    const double before_J = stored_J();
    step({});
    ASSERT_LT(stored_J(), before_J + 1e-7 * start_J + 1e-6) << k;
  }
}

struct Apart {
  double A = 0.0, rpm = 0.0, J = 0.0;
};

// Largest difference over a start-up under load, gates opened at its end.
Apart apart(const PlantConfig& a, const PlantConfig& b) {
  Plant one(a), other(b);
  Apart most;
  for (Plant* plant : {&one, &other}) plant->set_excitation({60.0, 1.0, true, 0.0, 0.0});
  for (int k = 0; k < 6000; ++k) {
    const InverterCommand command = k < 5000 ? Supply{60.0, 150.0}.at(one) : InverterCommand{};
    one.step(command), other.step(command);
    most.A = std::max(most.A, std::abs(one.state().i_s - other.state().i_s));
    most.rpm = std::max(most.rpm, std::abs(one.state().speed_rpm - other.state().speed_rpm));
    most.J = std::max(most.J, std::abs(one.powers().magnetic_J - other.powers().magnetic_J));
  }
  return most;
}

// Half the tolerance changes nothing that matters, nor does one ten thousand times tighter, which cuts the
// samples into many steps; and the fixed step follows within 1 mA and 0.01 rpm.
TEST_P(EveryEffect, IsConverged) {
  const PlantConfig c = with(read(GetParam(), GetParam().strong));
  PlantConfig half = c, tight = c, fixed = c;
  half.integrator.rtol *= 0.5, half.integrator.atol *= 0.5;
  tight.integrator.rtol = 1e-12, tight.integrator.atol = 1e-13;
  fixed.integrator.kind = IntegratorConfig::Kind::kRk4;
  const Apart by_half = apart(c, half), by_tight = apart(c, tight), by_fixed = apart(fixed, tight);
  std::printf("%-22s tolerance halved %.0e A %.0e rpm; 1e-12 %.0e A %.0e rpm; fixed step %.0e A %.0e rpm\n",
              GetParam().name.c_str(), by_half.A, by_half.rpm, by_tight.A, by_tight.rpm, by_fixed.A,
              by_fixed.rpm);
  for (const Apart& most : {by_half, by_tight}) {
    EXPECT_LT(most.A, 1e-4);
    EXPECT_LT(most.rpm, 1e-3);
    EXPECT_LT(most.J, 1e-4);
  }
  EXPECT_LT(by_fixed.A, 1e-3);
  EXPECT_LT(by_fixed.rpm, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryEffect, testing::ValuesIn(effect_registry()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace imrig::plant
