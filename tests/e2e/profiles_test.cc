// The papers' experiments as published, run as campaigns by the real processes on the emulator: what the records hold is compared with
// the circuit's own phasors and with the mechanics, from the parameters that the emulator's `truth` prints.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <complex>
#include <imrig_msg/record_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "rig/base/file.h"
#include "rig/base/space_vector.h"
#include "rig/bus/event_log.h"
#include "rig/bus/guarded_decode.h"
#include "rig/bus/log_records.h"
#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;
using Complex = std::complex<double>;

constexpr double kT = 60e-6;

struct Circuit {  // inverse-gamma
  double R_s, R_r, L_l, L_m;
  Complex impedance(double f_Hz, double slip) const {
    const Complex jw(0.0, 2 * kPi * f_Hz);
    return R_s + jw * L_l + 1.0 / (1.0 / (jw * L_m) + slip / R_r);
  }
};

Circuit true_circuit(const std::string& plant) {
  const auto told = run({"imrig-emulator", "truth", "--config", plant, "--json"});
  const json p = json::parse(told.out).at("parameters");
  const auto of = [&](const char* name) { return p.at(name).at("value").get<double>(); };
  return {of("R_s"), of("R_r"), of("L_l"), of("L_m")};
}

// First, last, least and greatest encoder count of each record.
struct Travel {
  std::int32_t first = 0, last = 0, least = 0, most = 0;
  bool still() const { return most - least <= 1; }  // a shaft at the edge between two counts
};

std::map<std::string, Travel> travels(const std::string& log) {
  std::map<std::int32_t, std::string> ids;
  std::map<std::string, Travel> all;
  EventLogReader reader(log);
  while (const auto event = reader.next()) {
    if (event->channel.ends_with("_RECORD"))
      if (const auto record = guarded_decode<imrig_msg::record_t>(event->data)) ids[record->number] = record->id;
    if (!event->channel.ends_with("_SAMPLES")) continue;
    const auto block = guarded_decode<imrig_msg::samples_t>(event->data);
    if (!block || block->record == 0 || !ids.contains(block->record)) continue;
    const auto [at, fresh] = all.try_emplace(ids[block->record]);
    Travel& t = at->second;
    if (fresh) t.first = t.least = t.most = block->encoder.front();
    const auto [least, most] = std::minmax_element(block->encoder.begin(), block->encoder.end());
    t.least = std::min(t.least, *least), t.most = std::max(t.most, *most), t.last = block->encoder.back();
  }
  return all;
}

struct Outcomes {
  DataSet data;
  std::map<std::string, Travel> shaft;
  const Record& at(const std::string& id) const {
    for (const Record& r : data.records)
      if (r.id == id) return r;
    throw std::out_of_range("no record " + id);
  }
};

Outcomes measure(const std::string& plan, const std::string& plant) {
  const Folder folder;
  const auto campaign = run({"imrig", "campaign", "run", plan, "--emulate", plant, "--pace", "max", "--seed", "7", "--out", folder / "out",
                             "--json"});
  EXPECT_EQ(campaign.exit_code, 0) << campaign.out << campaign.err;
  const json result = json::parse(campaign.out);
  EXPECT_EQ(result.at("points_infeasible"), 0) << campaign.out;
  EXPECT_EQ(result.at("lost_blocks"), 0);
  const std::string log = folder / "out/log-000.lcm";
  return {read_log(log), travels(log)};
}

const std::string& plant_file() {
  static const std::string path = source("models/plants/proca_5hp.toml");
  return path;
}

const Outcomes& papers() {
  static const Outcomes outcomes = measure(source("campaigns/papers.toml"), plant_file());
  return outcomes;
}

const Circuit& circuit() {
  static const Circuit c = true_circuit(plant_file());
  return c;
}

constexpr double kVoltageNoise_V = 0.25;  // of each component: voltage_noise_V of the plant x sqrt(2/3)

// Complex amplitude of exp(j 2 pi f t) in x between two samples, over whole periods.
Complex phasor(const std::vector<SpaceVector>& x, double f_Hz, std::size_t from, std::size_t to) {
  const double periods = std::floor(static_cast<double>(to - from) * kT * f_Hz);
  const auto n = static_cast<std::size_t>(std::llround(periods / f_Hz / kT));
  Complex sum = 0.0;
  for (std::size_t k = from; k < from + n; ++k) sum += x[k] * std::polar(1.0, -2 * kPi * f_Hz * kT * static_cast<double>(k));
  return sum / static_cast<double>(n);
}

Complex impedance_of(const Record& r, double f_Hz, std::size_t from, std::size_t to) {
  const Complex lag = 1.0 / Complex(1.0, 2 * kPi * f_Hz * r.series.voltage_filter_s);
  return phasor(r.series.v, f_Hz, from, to) / lag / phasor(r.series.i, f_Hz, from, to);
}

double mean_speed(const Record& r, std::size_t from, std::size_t to) {
  double sum = 0.0;
  for (std::size_t k = from; k < to; ++k) sum += r.series.speed_rad_s[k];
  return sum / static_cast<double>(to - from);
}

TEST(Profiles, DcBetweenTiedPhasesGivesTheStatorResistance) {
  for (const char* id : {"dc_4A", "dc_8A"}) {
    const TimeSeries& s = papers().at(id).series;
    Complex v = 0.0, i = 0.0;
    for (std::size_t k = 0; k < s.size(); ++k) v += s.v[k], i += s.i[k];
    EXPECT_NEAR((v / i).real(), circuit().R_s, 0.01 * circuit().R_s) << id;
    EXPECT_LT(std::abs((v / i).imag()), 0.01 * circuit().R_s) << id;
    EXPECT_TRUE(papers().shaft.at(id).still()) << id;
  }
}

// The loop of the published regulator around the circuit at standstill: i/i* = C/(C + Z), C = k_p + k_i/(jw).
TEST(Profiles, StandstillCurrentFollowsItsSumOfSinesAsTheLoopSays) {
  const Record& r = papers().at("standstill");
  const std::vector<double> amplitude_A = {3, 4, 6}, rate = {12, 25, 70};
  ASSERT_GT(r.series.size(), 90000u);
  // Least squares over the three tones: 6 s are no whole periods of all of them.
  const std::size_t from = 20000;  // beyond the loop's transient
  constexpr std::size_t kBasis = 7;
  double normal[kBasis][kBasis + 1] = {};
  double across = 0.0, along = 0.0;
  for (std::size_t k = from; k < r.series.size(); ++k) {
    const double t = static_cast<double>(k) * kT;
    double basis[kBasis + 1] = {1.0};
    for (std::size_t m = 0; m < 3; ++m) basis[1 + 2 * m] = std::sin(rate[m] * t), basis[2 + 2 * m] = std::cos(rate[m] * t);
    basis[kBasis] = r.series.i[k].imag();  // phase a idle: the axis of b and c in series
    across += std::norm(r.series.i[k].real()), along += std::norm(r.series.i[k].imag());
    for (std::size_t a = 0; a < kBasis; ++a)
      for (std::size_t b = 0; b <= kBasis; ++b) normal[a][b] += basis[a] * basis[b];
  }
  for (std::size_t a = 0; a < kBasis; ++a)  // Gauss and Jordan; the matrix is nearly diagonal
    for (std::size_t other = 0; other < kBasis; ++other) {
      if (other == a) continue;
      const double share = normal[other][a] / normal[a][a];
      for (std::size_t b = 0; b <= kBasis; ++b) normal[other][b] -= share * normal[a][b];
    }
  for (std::size_t m = 0; m < 3; ++m) {
    const std::size_t a = 1 + 2 * m;
    const Complex got(normal[a][kBasis] / normal[a][a], normal[a + 1][kBasis] / normal[a + 1][a + 1]);
    const Complex C(1.6, -116.0 / rate[m]);
    const Complex wanted = amplitude_A[m] * C / (C + circuit().impedance(rate[m] / (2 * kPi), 1.0));
    fmt::print("{:>4} rad/s: {:.3f} A at {:+.2f} deg, the loop says {:.3f} A at {:+.2f} deg\n", rate[m], std::abs(got),
               std::arg(got) * 180 / kPi, std::abs(wanted), std::arg(wanted) * 180 / kPi);
    EXPECT_LT(std::abs(got - wanted), 0.02 * amplitude_A[m]) << rate[m];
    EXPECT_GT(std::abs(got), 0.8 * amplitude_A[m]) << rate[m];
  }
  EXPECT_LT(across, 1e-4 * along);  // phase a carries nothing: no torque
  EXPECT_TRUE(papers().shaft.at("standstill").still());
}

TEST(Profiles, LockedLikeSweepMeasuresTheShortCircuitImpedanceOfAFreeShaft) {
  int seen = 0;
  for (const Record& r : papers().data.records) {
    if (r.kind != RecordKind::kLockedSweep) continue;
    const double f = r.set.f_Hz;
    const Complex is = impedance_of(r, f, 0, r.series.size()), right = circuit().impedance(f, 1.0);
    // Noise of the voltage, of which a low frequency needs a volt, five times; gains and the rest.
    const double noise = kVoltageNoise_V / std::sqrt(static_cast<double>(r.series.size())) / std::abs(phasor(r.series.i, f, 0, r.series.size()));
    EXPECT_LT(std::abs(is - right), 0.005 * std::abs(right) + 5.0 * noise) << r.id;
    EXPECT_TRUE(papers().shaft.at(r.id).still()) << r.id;
    ++seen;
  }
  EXPECT_EQ(seen, 17);  // 5 to 10 Hz by 1, 20 to 120 Hz by 10
  const std::int32_t between = papers().shaft.at("locked_f120").last - papers().shaft.at("locked_f5").first;
  EXPECT_LE(std::abs(between), 4) << "nor may it move between the records";
}

TEST(Profiles, NoLoadCurrentIsTheCircuitsAtTheMeasuredSlip) {
  for (const char* v : {"30", "50", "70", "90", "100"}) {
    const Record& r = papers().at(fmt::format("no_load_f60_v{}", v));
    const double slip = 1.0 - 2.0 * mean_speed(r, 0, r.series.size()) / (2 * kPi * 60.0);
    const Complex is = impedance_of(r, 60.0, 0, r.series.size()), right = circuit().impedance(60.0, slip);
    EXPECT_LT(std::abs(is - right), 0.01 * std::abs(right)) << v;
    EXPECT_LT(slip, 0.01) << v;
  }
}

TEST(Profiles, StepsRaiseTheVoltageByTenAndTwentyPercentAtSteadyState) {
  for (const auto& [id, step] : {std::pair{"step_10", 1.10}, std::pair{"step_20", 1.20}}) {
    const Record& r = papers().at(id);
    const std::size_t at = 1667, n = r.series.size();  // 0.1 s before it
    const double before = std::abs(phasor(r.series.v, 60.0, 0, at)), after = std::abs(phasor(r.series.v, 60.0, n - 3000, n));
    EXPECT_NEAR(after / before, step, 0.002) << id;
    const double quarter = mean_speed(r, 0, 400), half = mean_speed(r, 1200, 1600);
    EXPECT_NEAR(quarter, half, 1e-3 * half) << id << ": it was not steady";
    EXPECT_GT(mean_speed(r, n - 1000, n), half) << id;
  }
}

TEST(Profiles, StartsFromZero) {
  const Record& r = papers().at("startup_f30_v15");
  const std::size_t n = r.series.size();
  EXPECT_EQ(r.series.gates_on.front(), 0);
  EXPECT_NEAR(mean_speed(r, 0, 1000), 0.0, 1e-6);
  EXPECT_LT(std::abs(r.series.i.front()), 0.15);
  EXPECT_NEAR(mean_speed(r, n - 3000, n), kPi * 30.0, 0.02 * kPi * 30.0);
}

// With the gates off only friction brakes: J dw/dt = -(T_c + b w).
TEST(Profiles, CoastsDownAsItsFrictionSays) {
  const Record& r = papers().at("coast_down_f60_v100");
  const std::size_t a = 25000, b = 75000, window = 2000;  // the motor's flux has gone by then
  const double w_a = mean_speed(r, a - window, a + window), w_b = mean_speed(r, b - window, b + window);
  const double slope = (w_b - w_a) / (static_cast<double>(b - a) * kT);
  const double expected = -(0.25 + 0.0015 * 0.5 * (w_a + w_b)) / 0.047;
  fmt::print("coast-down: {:.2f} rad/s^2, friction over inertia says {:.2f}\n", slope, expected);
  EXPECT_NEAR(slope, expected, 0.03 * std::abs(expected));
  EXPECT_EQ(r.series.gates_on.back(), 0);
}

// Nothing holds this shaft at rest; its viscous friction only ends its turning after the sweep.
std::string free_plant(const Folder& folder) {
  std::string text = read_text(plant_file());
  const std::string friction = "coulomb_Nm = 0.25\nviscous_Nms = 0.0015\n";
  const auto at = text.find(friction);
  EXPECT_NE(at, std::string::npos);
  text.replace(at, friction.size(), "coulomb_Nm = 0.0\nviscous_Nms = 0.05\n");
  const std::string path = folder / "free.toml";
  write_text_atomically(path, text);
  return path;
}

// The standstill profile makes no torque at all, not merely too little; the turning field of the sweep does.
TEST(Profiles, AShaftThatNothingHoldsRestsAtStandstillAndTurnsInALockedSweep) {
  const Folder folder;
  const std::string plan = folder / "plan.toml";
  write_text_atomically(plan,
                        "version = 1\nname = \"free shaft\"\n[standstill]\nrecord_s = 3\n[locked_sweep]\nfrequencies_Hz = [5]\n"
                        "settle_s = 0.2\nrecord_s = 0.3\n");
  const Outcomes free = measure(plan, free_plant(folder));
  EXPECT_TRUE(free.shaft.at("standstill").still());
  EXPECT_GT(free.shaft.at("locked_f5").most - free.shaft.at("locked_f5").least, 20);
}

TEST(Profiles, SoaksUnderLoadAtHighPaceWithoutLosingASample) {
  const Folder folder;
  const std::string plan = folder / "plan.toml";
  std::string text = read_text(source("campaigns/soak.toml"));
  const std::string key = "settle_s = 1800";
  const auto at = text.find(key);
  ASSERT_NE(at, std::string::npos);
  write_text_atomically(plan, text.replace(at, key.size(), "settle_s = 90"));
  const Outcomes soak = measure(plan, plant_file());
  const TimeSeries &cold = soak.at("cold").series, &warm = soak.at("warm").series;
  EXPECT_GT(static_cast<double>(warm.first_index - cold.first_index) * kT, 90.0);
  EXPECT_GT(std::abs(phasor(warm.i, 60.0, 0, warm.size())), 5.0);
}

}  // namespace
}  // namespace imrig::test
