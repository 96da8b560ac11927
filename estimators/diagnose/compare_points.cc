#include "estimators/diagnose/compare_points.h"

#include <cmath>
#include <numbers>

#include "estimators/diagnose/channel.h"

namespace imrig::est {

namespace {

constexpr double kToRms = 1.0 / std::numbers::sqrt2;

struct PointChannel {
  const char* name;
  const char* unit;
  double SteadyPoint::*place;
  double scale;  // to the unit told
};

const PointChannel kChannels[] = {{"current_A", "A", &SteadyPoint::i_peak_A, kToRms},
                                  {"input_power_W", "W", &SteadyPoint::p_in_W, 1.0},
                                  {"power_factor", "", &SteadyPoint::power_factor, 1.0},
                                  {"torque_Nm", "Nm", &SteadyPoint::torque_Nm, 1.0},
                                  {"output_power_W", "W", &SteadyPoint::p_out_W, 1.0}};

double square(double x) { return x * x; }

// Sigma of the table's own value; NaN if nothing is declared.
double own_sigma(const PointChannel& channel, const Noise& noise, const SteadyPoint& p) {
  if (channel.place == &SteadyPoint::i_peak_A) return noise.current_A;
  if (channel.place == &SteadyPoint::p_in_W) return noise.power_W;
  if (channel.place == &SteadyPoint::torque_Nm) return noise.torque_Nm;
  if (channel.place == &SteadyPoint::p_out_W) return noise.torque_Nm * std::abs(p.speed_rad_s);
  return std::abs(p.power_factor) * std::hypot(noise.power_W / p.p_in_W, noise.current_A / p.i_peak_A);
}

// Spread of the prediction over one sigma of an input; 0 where that noise is not known.
class InputNoise {
 public:
  InputNoise(const ModelPrediction& model, const Noise& noise, const SteadyPoint& p) {
    const auto at = [&](double dv, double dw) {
      SteadyPoint moved = p;
      moved.v_peak_V += dv;
      moved.speed_rad_s += dw;
      return model.point(moved);
    };
    voltage_ = !std::isnan(noise.voltage_V) && noise.voltage_V < p.v_peak_V;
    speed_ = !std::isnan(noise.speed_rad_s);
    if (voltage_) higher_v_ = at(noise.voltage_V, 0.0), lower_v_ = at(-noise.voltage_V, 0.0);
    if (speed_) higher_w_ = at(0.0, noise.speed_rad_s), lower_w_ = at(0.0, -noise.speed_rad_s);
  }
  double variance(double SteadyPoint::*place) const {
    double sum = 0.0;
    if (voltage_) sum += square(0.5 * (higher_v_.*place - lower_v_.*place));
    if (speed_) sum += square(0.5 * (higher_w_.*place - lower_w_.*place));
    return sum;
  }

 private:
  bool voltage_ = false, speed_ = false;
  SteadyPoint higher_v_, lower_v_, higher_w_, lower_w_;
};

}  // namespace

void compare_points(const ModelPrediction& model, const DataSet& data, const Record& record,
                    ComparedRecord& out) {
  for (const auto& measured : record.points) {
    const SteadyPoint predicted = model.point(measured);
    const InputNoise inputs(model, data.noise, measured);
    PointResult point;
    Stretch stretch;
    point.conditions = conditions_of(measured, data.pole_pairs, model.machine().R_s);
    for (const auto& channel : kChannels) {
      const double m = measured.*channel.place, p = predicted.*channel.place;
      point.channels[channel.name] = {channel.scale * m, channel.scale * p};
      stretch.signed_errors.push_back({channel.name, "", channel.scale * (m - p)});
      if (std::isnan(m) || std::isnan(p)) continue;
      const double variance =
          square(own_sigma(channel, data.noise, measured)) + inputs.variance(channel.place);
      const double scale2 = square(channel.scale);
      ChannelResult one;
      one.unit = channel.unit;
      one.dof = 1.0;
      add_value(one, scale2 * square(m - p), scale2 * square(m), scale2 * variance);
      add_sums(out.channels[channel.name], one);
      stretch.channels[channel.name] = one;
    }
    stretch.conditions = point.conditions;
    out.stretches.push_back(std::move(stretch));
    out.points.push_back(std::move(point));
  }
  for (auto& [name, channel] : out.channels) finish(channel);
  const auto current = out.channels.find("current_A");
  if (current != out.channels.end() && !std::isnan(current->second.floor)) out.floor_from = "declared noise";
}

}  // namespace imrig::est
