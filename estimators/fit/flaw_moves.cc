#include "estimators/fit/flaw_moves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kSpeed = 1e-3, kGain = 1e-2, kLate_s = 10e-6;

struct Named {
  Flaw flaw;
  const char* words;
};
constexpr std::array<Named, 4> kFlaws{{{Flaw::kSpeedHigh, "speed 0.1 % high"},
                                       {Flaw::kCurrentHigh, "current 1 % high"},
                                       {Flaw::kVoltageHigh, "voltage 1 % high"},
                                       {Flaw::kVoltageLate, "voltage 10 us late"}}};

// Straight lines between the samples; the first has nothing before it.
void delay(TimeSeries& s, double by_s) {
  const double part = by_s / s.sample_time_s;
  for (std::size_t k = s.v.size(); k-- > 1;) s.v[k] -= part * (s.v[k] - s.v[k - 1]);
}

void apply(TimeSeries& s, Flaw flaw, double times) {
  if (flaw == Flaw::kSpeedHigh) {
    for (double& w : s.speed_rad_s) w *= 1.0 + times * kSpeed;
  } else if (flaw == Flaw::kCurrentHigh) {
    for (SpaceVector& i : s.i) i *= 1.0 + times * kGain;
  } else if (flaw == Flaw::kVoltageHigh) {
    for (SpaceVector& v : s.v) v *= 1.0 + times * kGain;
  } else {
    delay(s, times * kLate_s);
  }
}

void scale_power(SteadyPoint& p, double factor) {
  p.p_in_W *= factor;
  p.q_var *= factor;
}

// The voltage's phase falls behind by theta: P' + jQ' = (P + jQ) exp(-j theta).
void turn_power(SteadyPoint& p, double theta) {
  const double S = 1.5 * p.v_peak_V * p.i_peak_A;
  const double Q = std::isfinite(p.q_var) ? p.q_var : std::sqrt(std::max(0.0, S * S - p.p_in_W * p.p_in_W));
  const double P = p.p_in_W;
  p.p_in_W = P * std::cos(theta) + Q * std::sin(theta);
  p.q_var = std::isfinite(p.q_var) ? Q * std::cos(theta) - P * std::sin(theta) : p.q_var;
  p.power_factor = std::isfinite(p.power_factor) ? p.p_in_W / S : p.power_factor;
}

void apply(SteadyPoint& p, Flaw flaw, double times) {
  const double gain = 1.0 + times * kGain;
  if (flaw == Flaw::kSpeedHigh) {
    p.speed_rad_s *= 1.0 + times * kSpeed;
  } else if (flaw == Flaw::kCurrentHigh) {
    p.i_peak_A *= gain;
    scale_power(p, gain);
  } else if (flaw == Flaw::kVoltageHigh) {
    p.v_peak_V *= gain;
    scale_power(p, gain);
  } else {
    turn_power(p, 2.0 * kPi * p.f_Hz * times * kLate_s);
  }
}

}  // namespace

DataSet flawed(const DataSet& data, Flaw flaw, double times) {
  DataSet out = data;
  for (Record& record : out.records) {
    apply(record.series, flaw, times);
    for (SteadyPoint& point : record.points) apply(point, flaw, times);
  }
  return out;
}

std::vector<FlawMoves> flaw_moves(const DataSet& data, const IdentifyOptions& options, const Model& found) {
  std::vector<FlawMoves> all;
  for (const Named& named : kFlaws) {
    FlawMoves row;
    row.flaw = named.words;
    try {
      const Model moved = identify(flawed(data, named.flaw), options).model;
      for (const auto& base : base_parameters()) {
        const Parameter &before = found.*base.place, &after = moved.*base.place;
        if (before.known() && after.known()) row.moved[base.name] = after.value / before.value - 1.0;
      }
    } catch (const Error& e) {
      row.failure = e.what();
    }
    all.push_back(std::move(row));
  }
  return all;
}

std::string add_moves(const std::string& json, const std::vector<FlawMoves>& moves) {
  auto out = nlohmann::ordered_json::parse(json);
  auto& rows = out["moves"] = nlohmann::ordered_json::array();
  for (const FlawMoves& row : moves) {
    rows.push_back({{"flaw", row.flaw}, {"relative", row.moved}});
    if (!row.failure.empty()) rows.back()["failure"] = row.failure;
  }
  return out.dump(2) + "\n";
}

}  // namespace imrig::est
