// How long a diagnosis and a whole improvement take: records of 5,000 samples of 60 us from the plant library,
// with an effect hidden in them, all sixteen candidates, two threads. Wall time.
// usage: imrig-bench-diagnose [--json] [NAME...]

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "bench/hidden/sealed.h"
#include "bench/result.h"
#include "estimators/diagnose/diagnose.h"
#include "estimators/fit/identify.h"
#include "rig/base/error.h"

namespace imrig::bench {
namespace {

constexpr std::uint64_t kSeed = 52;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// "42 records of 5000 samples".
std::string size_of(const DataSet& data) {
  return fmt::format("{} records of {} samples", data.records.size(), data.records.back().series.size());
}

int body(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const bool json = std::find(words.begin(), words.end(), "--json") != words.end();
  const auto wanted = [&](const char* name) {
    return words.size() == (json ? 1u : 0u) || std::find(words.begin(), words.end(), name) != words.end();
  };
  const Sealed sealed = make_sealed(cell("magnetizing_saturation"), Strength::kMedium, kSeed, {0.3, 1});
  const est::Model base = est::identify(sealed.data, {}).model;
  if (wanted("diagnose_s")) {
    const auto start = std::chrono::steady_clock::now();
    const est::Diagnosis d = est::diagnose(base, sealed.data);
    print({"diagnose_s", seconds_since(start), "s", 10.0, false,
           fmt::format("{}; {} {}", size_of(sealed.data), d.verdict, d.effect)},
          json);
  }
  if (wanted("improve_s")) {
    const auto start = std::chrono::steady_clock::now();
    const est::Improvement i = est::improve(base, sealed.data);
    const auto& changes = i.diagnosis.search.changes;
    print({"improve_s", seconds_since(start), "s", 30.0, false,
           fmt::format("{}; hold-out {:.2f} to {:.2f} %, floor {:.2f}", size_of(sealed.data),
                       100.0 * changes.front().holdout.nrmse(), 100.0 * changes.back().holdout.nrmse(),
                       100.0 * changes.back().holdout.floor())},
          json);
  }
  return 0;
}

}  // namespace
}  // namespace imrig::bench

int main(int argc, char** argv) {
  return imrig::run_main("imrig-bench-diagnose", imrig::bench::body, argc, argv);
}
