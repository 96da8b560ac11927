#pragma once
// What `imrig identify --json` says of a standstill record, beside its parameters.

#include <nlohmann/json_fwd.hpp>

namespace imrig::est {

struct StandstillReport;

// {"t": {R_s, R_r, L_s, L_m: {"value","ci95","unit"}}, "inverse_gamma": likewise, "amplification": {..},
// "noise_bias_percent": {..},
//  "seconds", "axis_deg", "published": {"c": [4], "t": {name: value} | null, "filters_rad_s": [h_0, h_1],
//  "step_s", "gain", "alpha"}}
nlohmann::ordered_json standstill_json(const StandstillReport& report);

}  // namespace imrig::est
