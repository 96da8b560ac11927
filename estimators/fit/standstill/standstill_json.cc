#include "estimators/fit/standstill/standstill_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/fit/standstill/standstill_records.h"
#include "estimators/fit/student_t.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json estimate(double value, double relative_sigma, double gain_sigma, const char* unit) {
  const double half = kNormal975 * std::hypot(relative_sigma, gain_sigma) * value;
  return {{"value", number(value)}, {"ci95", {number(value - half), number(value + half)}}, {"unit", unit}};
}

Json published_json(const StandstillReport& report) {
  Json out;
  out["c"] = report.published_c;
  if (const auto& t = report.published_circuit) {
    out["t"] = {{"R_s", t->R_s}, {"R_r", t->R_r}, {"L_s", t->L_ls + t->L_m}, {"L_m", t->L_m}};
  } else {
    out["t"] = nullptr;
  }
  const GradientConfig& config = report.published;
  out["filters_rad_s"] = {config.filters.h_0, config.filters.h_1};
  out["step_s"] = config.step_s;
  out["gain"] = config.gain;
  out["alpha"] = config.alpha;
  return out;
}

}  // namespace

nlohmann::ordered_json standstill_json(const StandstillReport& report) {
  const StandstillFit& fit = report.fit;
  Json out;
  out["t"] = {{"R_s", estimate(fit.t.R_s, fit.sigma[0], report.gain_sigma, "ohm")},
              {"R_r", estimate(fit.t.R_r, fit.sigma_R_r_t, report.gain_sigma, "ohm")},
              {"L_s", estimate(fit.t.L_ls + fit.t.L_m, fit.sigma_L_s, report.gain_sigma, "H")},
              {"L_m", estimate(fit.t.L_m, fit.sigma_L_m_t, report.gain_sigma, "H")}};
  out["inverse_gamma"] = {{"R_s", estimate(fit.theta.R_s, fit.sigma[0], report.gain_sigma, "ohm")},
                          {"R_r", estimate(fit.theta.R_r, fit.sigma[1], report.gain_sigma, "ohm")},
                          {"L_l", estimate(fit.theta.L_l, fit.sigma[2], report.gain_sigma, "H")},
                          {"L_m", estimate(fit.theta.L_m, fit.sigma[3], report.gain_sigma, "H")}};
  for (std::size_t k = 0; k < kStandstillParameters; ++k) {
    out["amplification"][kStandstillNames[k]] = number(fit.amplification[k]);
    out["noise_bias_percent"][kStandstillNames[k]] = number(100.0 * fit.noise_bias[k]);
  }
  out["seconds"] = report.seconds;
  out["axis_deg"] = report.axis_rad * 180.0 / kPi;
  out["published"] = published_json(report);
  return out;
}

}  // namespace imrig::est
