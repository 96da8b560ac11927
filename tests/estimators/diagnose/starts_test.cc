// Direct-on-line starts and nothing else, of a motor with deep bars: each start is cut into parts, which begin with a
// current deep in the bars that nobody knows. The motor is a ladder of layers, unlike the two of the library.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "estimators/diagnose/diagnose.h"
#include "estimators/diagnose/missing/trial.h"
#include "estimators/fit/identify.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/space_vector.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

// Inverse-Gamma circuit; layer 0 is the top of the bar. below[k] flows below layer k.
struct DeepBarMotor {
  static constexpr double kSupply_rad_s = 2.0 * kPi * 50.0;
  static constexpr std::size_t kLayers = 8;
  int pole_pairs = 2;
  double R_s = 0.46, R_bar = 0.26, R_ring = 0.08, L_l = 5.3e-3, L_m = 0.106;
  double slot_H = 3e-3;  // leakage between top and bottom of the slot
  double inertia = 0.02;
  double ring_per_rad_s = 0.0;  // of the ring, in the supply's slip frequency

  struct State {
    Complex psi_s, psi_r;
    std::array<Complex, kLayers - 1> below{};
    double w_r = 0.0;
  };

  Complex i_s(const State& x) const { return (x.psi_s - x.psi_r) / L_l; }

  State slope(const State& x, Complex v, double load_Nm) const {
    const double ring = R_ring * (1.0 + ring_per_rad_s * std::abs(kSupply_rad_s - x.w_r));
    const Complex i_r = x.psi_r / L_m - i_s(x);
    const double R = R_bar * kLayers, L = slot_H / kLayers;
    const auto layer = [&](std::size_t k) {
      return (k == 0 ? i_r : x.below[k - 1]) - (k + 1 == kLayers ? Complex(0.0) : x.below[k]);
    };
    State d;
    d.psi_s = v - R_s * i_s(x);
    d.psi_r = -R * layer(0) - ring * i_r + Complex(0.0, x.w_r) * x.psi_r;
    for (std::size_t k = 0; k + 1 < kLayers; ++k)
      d.below[k] = R / L * (layer(k) - layer(k + 1)) + Complex(0.0, x.w_r) * x.below[k];
    const double torque = 1.5 * pole_pairs * (std::conj(x.psi_s) * i_s(x)).imag();
    d.w_r = pole_pairs * (torque - load_Nm) / inertia;
    return d;
  }

  // Of the bar and its ring at slip frequency w, from the ladder's bottom up.
  Complex bar_impedance(double w) const {
    const double R = R_bar * kLayers;
    const Complex step(0.0, w * slot_H / kLayers);
    Complex z = R;
    for (std::size_t k = 1; k < kLayers; ++k) z = R * (z + step) / (R + z + step);
    return z + R_ring;
  }
};

DeepBarMotor::State ahead(const DeepBarMotor::State& x, double h, const DeepBarMotor::State& d) {
  DeepBarMotor::State y = x;
  y.psi_s += h * d.psi_s, y.psi_r += h * d.psi_r, y.w_r += h * d.w_r;
  for (std::size_t k = 0; k < y.below.size(); ++k) y.below[k] += h * d.below[k];
  return y;
}

// A fan on the shaft, switched to the mains at 20 ms.
TimeSeries start_of(const DeepBarMotor& motor, double v_peak_V, double angle, double fan) {
  constexpr double kSample_s = 200e-6, kOn_s = 0.02, w = DeepBarMotor::kSupply_rad_s;
  constexpr int kFine = 40;
  TimeSeries out;
  out.sample_time_s = kSample_s;
  DeepBarMotor::State x;
  const auto v = [&](double t) { return t < kOn_s ? Complex(0.0) : std::polar(v_peak_V, w * t + angle); };
  for (int k = 0; k < 4000; ++k) {
    out.v.push_back(v(k * kSample_s));
    out.i.push_back(motor.i_s(x));
    out.speed_rad_s.push_back(x.w_r / motor.pole_pairs);
    const double h = kSample_s / kFine;
    for (int m = 0; m < kFine; ++m) {
      const double t = k * kSample_s + m * h;
      const auto slope = [&](const DeepBarMotor::State& y, double at) {
        return motor.slope(y, v(at), fan * y.w_r * y.w_r);
      };
      const auto a = slope(x, t), b = slope(ahead(x, 0.5 * h, a), t + 0.5 * h),
                 c = slope(ahead(x, 0.5 * h, b), t + 0.5 * h), d = slope(ahead(x, h, c), t + h);
      x = ahead(ahead(ahead(ahead(x, h / 6.0, a), h / 3.0, b), h / 3.0, c), h / 6.0, d);
    }
  }
  return out;
}

using SpeedSensor = std::function<void(TimeSeries&)>;

// Six of them, one held out.
DataSet starts_of(const DeepBarMotor& motor, const SpeedSensor& sensor = {}) {
  DataSet data;
  data.name = "starts";
  data.pole_pairs = motor.pole_pairs;
  data.noise = {0.045, 0.4, 0.02, kMissing, kMissing};
  const double volts[] = {0.6, 1.0, 0.8, 0.9, 1.05, 0.7};
  for (std::size_t n = 0; n < std::size(volts); ++n) {
    Record r;
    r.id = fmt::format("start{}", n);
    r.kind = RecordKind::kStartup;
    r.holdout = n == 3;
    const double fan = 2e-4 * (1.0 + static_cast<double>(n % 3));
    r.series = start_of(motor, 326.6 * volts[n], 0.7 * static_cast<double>(n), fan);
    if (sensor) sensor(r.series);
    synthetic::add_noise(r.series, data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s, 50 + n);
    data.records.push_back(std::move(r));
  }
  return data;
}

std::string words(const Diagnosis& d) {
  return fmt::format("{} {}", d.verdict, fmt::join(d.explanation, "\n"));
}

TEST(Starts, AloneNameADeepBarAndItsImpedance) {
  const DeepBarMotor motor;
  const DataSet data = starts_of(motor);
  const Model model = identify(data).model;
  const Diagnosis d = diagnose(model, data);
  ASSERT_EQ(d.effect, "rotor_skin_effect") << words(d);
  EXPECT_EQ(d.verdict, "missing");
  EXPECT_LT(d.search.final.left_out_chi2, 1.2 * static_cast<double>(d.search.final.model.fit.values));
  const auto estimate = [&](const char* name) { return d.candidates.front().estimate.at(name).value; };
  const double R_r = d.search.final.model.at.shared[1], rise = estimate("rise"), corner = estimate("corner_rad_s");
  for (const double f_Hz : {5.0, 25.0, 50.0}) {
    // The library's upper and lower layer side by side.
    const double w = 2.0 * kPi * f_Hz, R_u = R_r * (1.0 + rise), R_b = R_u / rise;
    const Complex lower(R_b, w * R_b / corner);
    const double R = (R_u * lower / (R_u + lower)).real(), truth = motor.bar_impedance(w).real();
    EXPECT_NEAR(R, truth, 0.03 * truth) << f_Hz << " Hz";
  }
}
TEST(Starts, NameCurrentsThatComeLate) {
  DeepBarMotor motor;
  motor.R_bar = 0.0, motor.R_ring = 0.34;
  const auto a_sample_late = [](TimeSeries& s) {
    s.i.insert(s.i.begin(), s.i.front());
    s.i.pop_back();
  };
  const DataSet data = starts_of(motor, a_sample_late);
  const Diagnosis d = diagnose(identify(data).model, data);
  ASSERT_EQ(d.effect, "voltage_lag") << words(d);
  EXPECT_NEAR(d.candidates.front().estimate.at("lag_s").value, -200e-6, 10e-6);
  EXPECT_NE(words(d).find("it is the currents that come late"), std::string::npos) << words(d);
}

// As many simulations have it, whatever the flux does in a transient.
TEST(Starts, NameALineInTheSupplysSlipFrequency) {
  DeepBarMotor motor;
  motor.R_bar = 0.0, motor.R_ring = 0.34, motor.ring_per_rad_s = 0.003;
  const DataSet data = starts_of(motor);
  const Diagnosis d = diagnose(identify(data).model, data);
  ASSERT_EQ(d.effect, "rotor_skin_effect") << words(d);
  EXPECT_EQ(d.verdict, "missing") << words(d);
  ASSERT_TRUE(d.candidates.front().estimate.contains("per_rad_s")) << words(d);
  EXPECT_NEAR(d.candidates.front().estimate.at("per_rad_s").value, 0.003, 3e-5);
  EXPECT_NEAR(d.search.final.model.at.shared[1], 0.34, 0.003);
}

// What the bars had deep inside when a record began goes with them.
TEST(Starts, NothingStaysOfADeepBarThatIsTakenOut) {
  const DeepBarMotor motor;
  const DataSet data = starts_of(motor);
  const Model model = identify(data).model;
  const GlobalProblem problem(data, model.machine(), 2);
  const WorkingModel plain = working_model(problem, model);
  WorkingModel deep = plain;
  const std::size_t effect = *effect_number("rotor_skin_effect");
  deep.active = {{effect, 1}};
  ASSERT_STREQ(kEffectInfos[effect].forms[1].name, "two layers");
  for (LocalVector<double>& local : deep.at.local) local[4] = 20.0, local[5] = -10.0;
  const Trial before = refit(problem, plain, problem.fitted());
  const Trial after = try_removing(problem, deep, effect, problem.fitted());
  for (const LocalVector<double>& local : after.model.at.local) {
    EXPECT_EQ(local[4], 0.0);
    EXPECT_EQ(local[5], 0.0);
  }
  EXPECT_NEAR(after.chi2, before.chi2, 1e-3 * before.chi2);
}

// A filter of 4 ms, or counts of an encoder over the last 8 ms.
TEST(Starts, NameASpeedThatComesLate) {
  DeepBarMotor motor;
  motor.R_bar = 0.0, motor.R_ring = 0.34;  // no layer is deeper than another
  const auto filter = [](TimeSeries& s) {
    double late = s.speed_rad_s.front();
    for (double& w : s.speed_rad_s) w = late += (1.0 - std::exp(-s.sample_time_s / 4e-3)) * (w - late);
  };
  const auto window = [](TimeSeries& s) {
    const std::vector<double> w = s.speed_rad_s;
    const auto counted = static_cast<std::size_t>(std::lround(8e-3 / s.sample_time_s));
    for (std::size_t k = 0; k < w.size(); ++k) {
      double sum = 0.0;
      for (std::size_t m = 0; m < counted; ++m) sum += w[k - std::min(k, m)];
      s.speed_rad_s[k] = sum / static_cast<double>(counted);
    }
  };
  const std::pair<SpeedSensor, std::string> sensors[] = {{filter, "as behind a first-order filter"},
                                                         {window, "as counts over the last 8"}};
  for (const auto& [sensor, what] : sensors) {
    const DataSet data = starts_of(motor, sensor);
    const Diagnosis d = diagnose(identify(data).model, data);
    EXPECT_EQ(d.effect, "speed_bias") << words(d);
    EXPECT_EQ(d.verdict, "missing") << words(d);
    EXPECT_EQ(d.search.final.model.active.size(), 1u) << words(d);
    ASSERT_TRUE(d.candidates.front().estimate.contains("lag_s"));
    EXPECT_NEAR(d.candidates.front().estimate.at("lag_s").value, 4e-3, 0.1e-3);
    EXPECT_LT(d.search.final.left_out_chi2, 1.5 * static_cast<double>(d.search.final.model.fit.values));
    EXPECT_NE(words(d).find(what), std::string::npos) << words(d);
  }
}

}  // namespace
}  // namespace imrig::est
