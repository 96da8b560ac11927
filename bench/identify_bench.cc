// Identification: how near its spread comes to the Cramer-Rao bound, how long it takes, and how it stands against SciPy.
//   crlb_ratio_l_m, crlb_ratio_r_r, crlb_ratio_l_l, identify_290_s, global_fit_s, identify_vs_scipy
// usage: imrig-bench-identify [--json] [--grid LOG] --root DIR NAME...    --grid: a log of campaigns/proca_grid.toml, else one is taken

#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>
#include <vector>

#include "bench/command.h"
#include "bench/hidden/share.h"
#include "bench/result.h"
#include "estimators/diagnose/refit_model.h"
#include "estimators/fit/identify.h"
#include "rig/base/clock.h"
#include "rig/bus/log_records.h"
#include "rig/data/folder.h"
#include "tests/estimators/fit/spread.h"

namespace imrig::bench {
namespace {

using nlohmann::json;
namespace synthetic = est::synthetic;

constexpr int kSeeds = 200;
constexpr std::size_t kGrid = 290;  // records of the paper
constexpr int kThreads = 2;

double seconds_since(std::int64_t start_us) { return 1e-6 * static_cast<double>(monotonic_us() - start_us); }

// ---- spread over seeds, of motors of 0.5, 3.7 and 50 kW

struct Scatter {
  const char* motor = "";
  synthetic::Spread spread;
  synthetic::Three bound{};
};

std::vector<Scatter> scatters() {
  std::vector<Scatter> all;
  for (const std::size_t which : {0u, 1u, 3u}) {
    const synthetic::Motor& m = synthetic::motors()[which];
    const auto c = synthetic::released_case(m, 3000);
    const double noise = synthetic::usual_noise_A(m, c);
    all.push_back({m.name, synthetic::spread_of(m, synthetic::record(m, c), noise, 0.0, 0.0, kSeeds),
                   synthetic::cramer_rao(m, c, noise)});
  }
  return all;
}

Result crlb_ratio(const std::string& name, std::size_t k, const std::vector<Scatter>& all) {
  double worst = 0.0, bias = 0.0;
  Share covered;
  std::string each;
  for (const Scatter& s : all) {
    const double ratio = s.spread.deviation[k] / s.bound[k];
    worst = std::max(worst, ratio);
    bias = std::max(bias, std::abs(s.spread.bias[k]) / s.bound[k]);
    covered.of += s.spread.seeds;
    covered.good += s.spread.covered[k];
    each += fmt::format("{}{} {:.3f}", each.empty() ? "" : ", ", s.motor, ratio);
  }
  return {name, worst, "x bound", 1.15, false,
          fmt::format("{} over {} seeds a motor, white current noise of 0.3 %: {} (a ratio is known to {:.0f} %); worst bias {:.2f} "
                      "of the bound (a third allowed); 95 % intervals hold {} of {}, {:.1f} % [{:.1f}, {:.1f}]",
                      synthetic::kSpreadNames[k], kSeeds, each, 100.0 / std::sqrt(2.0 * kSeeds), bias, covered.good, covered.of,
                      100.0 * covered.value(), 100.0 * covered.low(), 100.0 * covered.high())};
}

// ---- on the rig's own records

class OnRecords {
 public:
  OnRecords(std::string root, std::string grid_log) : root_(std::move(root)), grid_log_(std::move(grid_log)) {}

  Result identify_290_s() {
    const Grid& g = grid();
    return {"identify_290_s", g.identify_s, "s", 5.0, false,
            fmt::format("{} records of campaigns/proca_grid.toml on {} ({} samples each) and {} dc records, {} threads, {:.1f} s of "
                        "processor time; reading them took {:.1f} s more",
                        g.steps, kFull, g.samples, g.data.records.size() - g.steps, kThreads, g.processor_s, g.read_s)};
  }

  Result global_fit_s() {
    const Grid& g = grid();
    est::Model model = g.model;
    for (const char* name : {"magnetizing_saturation", "leakage_saturation", "rotor_skin_effect", "core_loss", "rotor_heating"})
      model.effects.push_back({name, "", {}});
    const std::int64_t start = monotonic_us();
    const est::Model found = est::refit_model(model, g.data, "benchmark", kThreads);
    const est::Revision& r = found.history.back();
    return {"global_fit_s", seconds_since(start), "s", 10.0, false,
            fmt::format("the same {} records at once, five effects (both saturations, skin effect, core loss, heat of the cage), {} "
                        "threads; current error {:.2f} % where constant parameters leave {:.2f} % and noise {:.2f} %",
                        g.data.records.size(), kThreads, 100.0 * r.fitted_nrmse, 100.0 * g.model.history.back().fitted_nrmse,
                        100.0 * r.floor_nrmse)};
  }

  // The same files, one core each: records of the linear plant, whose truth is known.
  Result identify_vs_scipy() {
    const std::string plan = scratch_ / "short.toml", folder = scratch_ / "short_csv";
    write_text_atomically(plan,
                          "version = 1\nname = \"short\"\n[grid]\nfrequencies_Hz = [40, 60]\nvoltages_percent = [40, 70]\nloads = 3\n"
                          "step_percent = 10\nsettle_s = 0.6\nsettle_bound_s = 1.5\nbefore_s = 0.05\nrecord_s = 0.2\n");
    DataSet data = read_log(campaign(plan, kLinear, "short"));
    std::erase_if(data.records, [](const Record& r) { return r.kind != RecordKind::kStep; });
    std::erase_if(data.records, [](const Record& r) { return r.id.ends_with("_l0"); });  // no load tells neither R_r nor L_l
    write_folder(data, folder);
    const json truth = answer(fmt::format("imrig-emulator truth --config {}/models/plants/{} --json", root_, kLinear)).at("parameters");
    const auto true_value = [&](const char* name) { return truth.at(name).at("value").get<double>(); };
    est::IdentifyOptions options;
    options.method = "transient";
    options.threads = 1;
    options.max_relative_sigma = 1.0;
    est::Model start;
    start.pole_pairs = data.pole_pairs;
    start.R_s.value = true_value("R_s");
    start.R_r.value = 1.2 * true_value("R_r");
    start.L_l.value = 0.8 * true_value("L_l");
    start.L_m.value = 1.1 * true_value("L_m");
    options.nominal = start;
    const DataSet read = read_folder(folder);
    const std::int64_t begin = monotonic_us();
    const est::IdentifyResult own = est::identify(read, options);
    const double own_s = seconds_since(begin);
    const json other = json_of(fmt::format("/usr/bin/python3 {}/bench/identify_vs_scipy.py {} {} {} {} {}", root_, folder,
                                           start.R_s.value, start.R_r.value, start.L_l.value, start.L_m.value));
    const double n = static_cast<double>(other.size());
    double other_s = 0.0, own_error = 0.0, other_error = 0.0;
    std::string errors;
    for (const char* name : {"R_r", "L_l", "L_m"}) {
      double own2 = 0.0, other2 = 0.0;
      for (std::size_t k = 0; k < other.size(); ++k) {
        own2 += std::pow(own.records[k].parameters.at(name).value / true_value(name) - 1.0, 2);
        other2 += std::pow(other[k].at(name).get<double>() / true_value(name) - 1.0, 2);
      }
      own_error += own2, other_error += other2;
      errors += fmt::format(", {} {:.2f} against {:.2f} %", name, 100.0 * std::sqrt(own2 / n), 100.0 * std::sqrt(other2 / n));
    }
    double own_misfit2 = 0.0, other_misfit2 = 0.0;
    for (std::size_t k = 0; k < other.size(); ++k) {
      other_s += other[k].at("seconds").get<double>();
      own_misfit2 += std::pow(own.records[k].nrmse, 2);
      other_misfit2 += std::pow(other[k].at("nrmse").get<double>(), 2);
    }
    return {"identify_vs_scipy", other_s / own_s, "x faster", 300.0, true,
            fmt::format("{} records of {} samples, a core each, reading not counted, from the same start: {:.1f} ms a record with "
                        "intervals against {:.1f} s of solve_ivp + least_squares without; error against the truth, rms{} ({}); "
                        "misfit of the current, rms {:.3f} against {:.3f} %",
                        other.size(), read.records.front().series.size(), 1e3 * own_s / static_cast<double>(other.size()),
                        other_s / static_cast<double>(other.size()), errors, own_error <= other_error ? "equal or better" : "WORSE",
                        100.0 * std::sqrt(own_misfit2 / n), 100.0 * std::sqrt(other_misfit2 / n))};
  }

 private:
  static constexpr const char* kFull = "proca_5hp_full.toml";
  static constexpr const char* kLinear = "proca_5hp.toml";

  struct Grid {
    DataSet data;
    est::Model model;
    std::size_t steps = 0, samples = 0;
    double read_s = 0.0, identify_s = 0.0, processor_s = 0.0;
  };

  // A campaign's log.
  std::string campaign(const std::string& plan, const std::string& plant, const std::string& name) const {
    const std::string folder = scratch_ / name;
    answer(fmt::format("imrig campaign run {} --emulate {}/models/plants/{} --pace max --out {} --json", plan, root_, plant, folder));
    return folder + "/log-000.lcm";
  }

  // Recorded and identified once.
  const Grid& grid() {
    if (grid_) return *grid_;
    Grid g;
    const std::string log =
        grid_log_.empty() ? campaign(root_ + "/campaigns/proca_grid.toml", kFull, "grid") : grid_log_;
    const std::int64_t start = monotonic_us();
    g.data = read_log(log);
    g.read_s = seconds_since(start);
    std::erase_if(g.data.records, [&](const Record& r) {
      return r.holdout || (r.kind != RecordKind::kDc && (r.kind != RecordKind::kStep || ++g.steps > kGrid));
    });
    if (g.steps < kGrid) throw Error(log, fmt::format("holds {} step records to fit", g.steps), fmt::format("{}", kGrid));
    g.steps = kGrid;
    g.samples = g.data.records.back().series.size();
    const std::int64_t begin = monotonic_us();
    const std::clock_t processor = std::clock();
    est::IdentifyOptions options;
    options.threads = kThreads;
    g.model = est::identify(g.data, options).model;
    g.identify_s = seconds_since(begin);
    g.processor_s = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
    grid_ = std::move(g);
    return *grid_;
  }

  std::string root_, grid_log_;
  Scratch scratch_;
  std::optional<Grid> grid_;
};

int body(int argc, char** argv) {
  bool as_json = false;
  std::string root = ".", grid_log;
  std::vector<std::string> names;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--json") as_json = true;
    else if (word == "--root" && k + 1 < argc) root = argv[++k];
    else if (word == "--grid" && k + 1 < argc) grid_log = argv[++k];
    else names.push_back(word);
  }
  OnRecords records(root, grid_log);
  std::vector<Scatter> all;
  for (const std::string& name : names) {
    if (name.starts_with("crlb_ratio_") && all.empty()) all = scatters();
    if (name == "crlb_ratio_r_r") print(crlb_ratio(name, 0, all), as_json);
    else if (name == "crlb_ratio_l_l") print(crlb_ratio(name, 1, all), as_json);
    else if (name == "crlb_ratio_l_m") print(crlb_ratio(name, 2, all), as_json);
    else if (name == "identify_290_s") print(records.identify_290_s(), as_json);
    else if (name == "global_fit_s") print(records.global_fit_s(), as_json);
    else if (name == "identify_vs_scipy") print(records.identify_vs_scipy(), as_json);
    else throw Error("usage", fmt::format("no benchmark is called {}", name));
  }
  return 0;
}

}  // namespace
}  // namespace imrig::bench

int main(int argc, char** argv) { return imrig::run_main("imrig-bench-identify", imrig::bench::body, argc, argv); }
