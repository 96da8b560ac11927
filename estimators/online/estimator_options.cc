#include "estimators/online/estimator_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

void add_options(CLI::App& app, EstimatorOptions& o) {
  app.add_option("--config", o.config, "the rig's configuration")->capture_default_str();
  app.add_option("--model", o.model, "model file; without it the rig's nominal motor");
  app.add_option("--url", o.url, "LCM URL, before the configuration's; file://LOG?speed=0 reads a log as fast as it can");
  app.add_option("--out", o.out, "event log that keeps the estimates");
  app.add_option("--elsewhere", o.elsewhere_rad_s, "electrical slip frequency, rad/s, at which R_r is predicted; without it the rated one")
      ->check(CLI::Range(0.0, 1e4));
  app.add_option("--least-slip", o.least_slip, "slip below which the observer gives no R_r")
      ->check(CLI::Range(0.0, 0.5))
      ->capture_default_str();
  app.add_flag("--no-joint", o.no_joint, "leave the joint filter of R_r, R_s, L_m out");
  app.add_option("--realtime", o.realtime, "SCHED_FIFO priority, where the system allows it")->check(CLI::Range(1, 99));
  app.add_flag("--lock-memory", o.lock_memory, "keep all memory resident, where the system allows it");
}

EstimatorConfig estimator_config(const EstimatorOptions& o, const RigConfig& rig) {
  const Model model = o.model.empty() ? nominal_model(rig.motor) : load_model(o.model);
  if (model.pole_pairs != rig.motor.pole_pairs) {
    throw Error(o.model, fmt::format("is of a motor with {} pole pairs", model.pole_pairs),
                fmt::format("the rig's motor has {}", rig.motor.pole_pairs));
  }
  EstimatorConfig c;
  c.follower.motor = knowledge_of(model);
  c.follower.current_gain_sigma = rig.accuracy.current_gain;
  c.follower.voltage_gain_sigma = rig.accuracy.voltage_gain;
  c.follower.least_slip = o.least_slip;
  c.follower.joint = !o.no_joint;
  const double rated = 2.0 * kPi * rig.motor.rated_frequency_Hz - rig.motor.pole_pairs * rad_s_of_rpm(rig.motor.rated_speed_rpm);
  c.w_elsewhere_rad_s = o.elsewhere_rad_s > 0.0 ? o.elsewhere_rad_s : rated;
  return c;
}

}  // namespace imrig::est
