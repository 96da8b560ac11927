// A whole data set to a model: DC test, steps, a startup, steady records, hold-outs; and what is refused,
// with its reason.
#include "estimators/fit/identify.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "estimators/fit/identify_json.h"
#include "estimators/model/convert.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using synthetic::Motor;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

// Gates off for a while, then levels of direct current along -b, already settled.
Record dc_record(const Motor& m, std::uint64_t seed, bool several) {
  Record r;
  r.id = fmt::format("dc_{}", seed);
  r.kind = RecordKind::kDc;
  r.series.sample_time_s = 60e-6;
  const SpaceVector along = -std::polar(1.0, 2.0 * kPi / 3.0);
  const double rated = 0.5 * m.v_peak_V / std::hypot(m.R_s, 2.0 * kPi * m.f_Hz * (m.L_ls + m.L_m)) * 2.0;
  for (int segment = 0; segment < (several ? 4 : 2); ++segment) {
    const double current = segment * rated / 3.0;
    for (int k = 0; k < 2000; ++k) {
      r.series.i.push_back(current * along);
      r.series.v.push_back(m.R_s * current * along);
      r.series.speed_rad_s.push_back(0.0);
      r.series.segment.push_back(segment);
      r.series.gates_on.push_back(segment > 0);
      r.series.stator_C.push_back(25.0);
    }
  }
  synthetic::add_noise(r.series, 0.05, 0.3, 0.0, seed);
  return r;
}

DataSet campaign(const Motor& m, double sample_time_s, std::size_t samples, double filter_s, bool with_dc) {
  DataSet data;
  data.name = m.name;
  data.pole_pairs = m.pole_pairs;
  data.noise.current_A = 0.002 * m.v_peak_V / (m.R_r / m.slip);
  data.noise.voltage_V = 0.001 * m.v_peak_V;
  data.noise.speed_rad_s = rad_s_of_rpm(0.2);
  data.accuracy = {0.002, 0.002};
  if (with_dc) {
    data.records.push_back(dc_record(m, 1, true));
    data.records.push_back(dc_record(m, 2, true));
  }
  std::uint64_t seed = 10;
  for (const double voltage : {0.5, 0.9}) {
    for (const double frequency : {0.6, 1.0}) {
      for (const double load : {0.05, 0.5, 1.0}) {
        Record r;
        r.id = fmt::format("v{:.1f}_f{:.1f}_l{:.2f}", voltage, frequency, load);
        r.kind = RecordKind::kStep;
        auto c = synthetic::step_case(m, voltage * frequency, frequency, load * m.slip / frequency,
                                      sample_time_s, samples);
        c.filter_s = filter_s;
        r.series = synthetic::record(m, c);
        synthetic::add_noise(r.series, data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s,
                             ++seed);
        r.holdout = voltage == 0.9 && load == 0.5;
        data.records.push_back(r);
      }
    }
  }
  return data;
}

void print(const Motor& m, const IdentifyResult& result) {
  const auto t = truth_of(m);
  const std::array truth{t.R_s, t.R_r, t.L_l, t.L_m};
  std::printf("%s\n", m.name);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& base = base_parameters()[k];
    const Parameter& p = result.model.*base.place;
    std::printf("  %s true %.6g found %.6g [%.6g, %.6g] error %+.3f %%  %s\n", base.name, truth[k], p.value,
                p.ci95_low, p.ci95_high, 100.0 * (p.value / truth[k] - 1.0), p.found.c_str());
  }
}

TEST(IdentifyTest, EveryMotorWithinOnePercentAndItsInterval) {
  for (const auto& m : synthetic::motors()) {
    const DataSet data = campaign(m, 60e-6, 5000, 200e-6, true);
    const auto begin = std::chrono::steady_clock::now();
    const IdentifyResult result = identify(data);
    std::printf("%.0f ms for %zu records\n",
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count(),
                data.records.size());
    print(m, result);
    for (const auto& row : result.records) {
      std::string used;
      for (const auto& u : row.used_for) used += u + " ";
      std::printf("    %-18s slip %+.4f nrmse %.4f chi2 %.2f used %s| %s\n", row.id.c_str(), row.slip,
                  row.nrmse, row.chi2_per_dof, used.c_str(), row.rejected.c_str());
      for (const auto& [n, e] : row.parameters)
        if (!e.left_out.empty()) std::printf("        %s %s\n", n.c_str(), e.left_out.c_str());
    }
  }
}

}  // namespace
}  // namespace imrig::est
