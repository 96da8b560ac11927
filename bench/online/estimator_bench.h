#pragma once
// Benchmarks of the online estimator; docs/benchmarks.md says what each figure means.

#include <cstdint>
#include <string>
#include <vector>

#include "bench/result.h"
#include "estimators/online/estimator.h"

namespace imrig::bench {

// SAMPLES messages of an emulated motor under load with steps of it: the 5 hp plant, noisy 12-bit converters.
std::vector<std::vector<std::uint8_t>> motor_messages(const std::string& root, double seconds);
est::EstimatorConfig estimator_config(const std::string& root);

Result estimator_latency_ratio(const std::string& root, int seconds);
int answer_echoes(const std::string& url);  // the echo's own process
std::vector<Result> soak(const std::string& root, double minutes);
// Prints a table: error, lag and cost of the observer, the joint filter and both predictions on the same samples.
void compare_estimators(const std::string& root);

}  // namespace imrig::bench
