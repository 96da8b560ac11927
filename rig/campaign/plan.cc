#include "rig/campaign/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "rig/base/config_reader.h"
#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {

namespace {

constexpr std::size_t kMostPoints = 20000;

struct Named {
  PointKind kind;
  const char* word;
};
constexpr Named kKinds[] = {{PointKind::kDc, "dc"},
                            {PointKind::kStandstill, "standstill"},
                            {PointKind::kLockedSweep, "locked_sweep"},
                            {PointKind::kStartup, "startup"},
                            {PointKind::kNoLoad, "no_load"},
                            {PointKind::kSteady, "steady"},
                            {PointKind::kStep, "step"},
                            {PointKind::kCoastDown, "coast_down"}};

// 60 -> "60", 32.5 -> "32p5": ids serve as file names.
std::string in_id(double x) {
  std::string text = fmt::format("{:.6g}", x);
  std::replace(text.begin(), text.end(), '.', 'p');
  std::replace(text.begin(), text.end(), '-', 'm');
  return text;
}

std::string grid_id(PointKind kind, double f, double v, const std::string& load) {
  const std::string place = fmt::format("f{}_v{}{}{}", in_id(f), in_id(v), load.empty() ? "" : "_", load);
  return kind == PointKind::kStep ? place : fmt::format("{}_{}", point_kind_word(kind), place);
}

// Times that a table may set, with the kind's own defaults.
void read_times(const ConfigReader& table, PlanPoint& point) {
  const bool rests = begins_at_rest(point.kind);
  point.settle_s = table.number_or("settle_s", rests ? 1.0 : 0.8, {0, 36000});
  point.settle_bound_s =
      rests ? point.settle_s : table.number_or("settle_bound_s", std::max(3.0, point.settle_s), {0, 36000});
  if (point.settle_bound_s < point.settle_s)
    table.fail("settle_bound_s", "is shorter than settle_s", "the bound is the longest wait");
  const bool event = point.kind == PointKind::kStep || point.kind == PointKind::kStartup ||
                     point.kind == PointKind::kCoastDown;
  if (event) point.before_s = table.number_or("before_s", 0.1, {0, 60});
  const double usual = point.kind == PointKind::kStandstill  ? 6.0
                       : point.kind == PointKind::kCoastDown ? 2.0
                                                             : 0.5;
  point.record_s = table.number_or("record_s", usual, {1e-3, 600});
}

struct LoadChoice {
  LoadRequest request;
  std::string word;  // "l3"
};

std::vector<LoadChoice> read_loads(const ConfigReader& table) {
  std::vector<LoadChoice> loads;
  if (table.has("loads_Nm")) {
    if (table.has("loads")) table.fail("loads", "stands beside loads_Nm", "give one of the two");
    for (const double torque : table.numbers("loads_Nm", 1, 100, {0, 1e5}))
      loads.push_back({{torque, std::nan("")}, fmt::format("l{}", loads.size())});
    return loads;
  }
  if (table.has("loads_share")) {
    if (table.has("loads")) table.fail("loads", "stands beside loads_share", "give one of the two");
    for (const double share : table.numbers("loads_share", 1, 100, {0, 1}))
      loads.push_back({{0.0, share}, fmt::format("l{}", loads.size())});
    return loads;
  }
  const long long count = table.integer_or("loads", 1, {1, 100});
  for (long long k = 0; k < count; ++k) {
    const double share = count == 1 ? 0.0 : static_cast<double>(k) / static_cast<double>(count - 1);
    loads.push_back({{0.0, share}, fmt::format("l{}", k)});
  }
  return loads;
}

class Expansion {
 public:
  Expansion(const ConfigReader& file, Plan& plan) : file_(file), plan_(plan) {}

  void dc() {
    const auto table = file_.table_if("dc");
    if (!table) return;
    PlanPoint point;
    point.kind = PointKind::kDc;
    read_times(*table, point);
    for (const double level : table->numbers("levels_A", 1, 50, {1e-3, 1e4})) {
      point.level_A = level;
      point.id = fmt::format("dc_{}A", in_id(level));
      add(*table, point);
    }
  }

  void standstill() {
    const auto table = file_.table_if("standstill");
    if (!table) return;
    PlanPoint point;
    point.kind = PointKind::kStandstill;
    point.id = "standstill";
    read_times(*table, point);
    point.tones.offset_A = table->number_or("offset_A", 0.0, {-1e4, 1e4});
    point.tones.amplitude_A = {3, 4, 6};
    std::vector<double> rates = {12, 25, 70};
    if (table->has("tones_A") || table->has("tones_rad_s")) {
      point.tones.amplitude_A = table->numbers("tones_A", 1, 8, {1e-6, 1e4});
      rates = table->numbers("tones_rad_s", 1, 8, {1e-3, 5e4});
    }
    if (rates.size() != point.tones.amplitude_A.size())
      table->fail("tones_A", "has not as many values as tones_rad_s", "one amplitude for each tone");
    for (const double w : rates) point.tones.frequency_Hz.push_back(w / (2 * std::numbers::pi));
    point.tones.kp_V_per_A = table->number_or("kp_V_per_A", 1.6, {0, 1e4});
    point.tones.ki_V_per_As = table->number_or("ki_V_per_As", 116.0, {0, 1e6});
    point.tones.period_s = table->number_or("regulator_period_s", point.tones.period_s, {1e-6, 1.0});
    add(*table, point);
  }

  // The locked-rotor test of a motor that nobody locks: a turning field too weak to turn the shaft, or a
  // regulated current along one axis, which makes no torque at all and does not lose its voltage to the
  // inverter's dead time.
  void locked_sweep() {
    const auto table = file_.table_if("locked_sweep");
    if (!table) return;
    PlanPoint point;
    point.kind = PointKind::kLockedSweep;
    read_times(*table, point);
    std::vector<double> frequencies = {5, 6, 7, 8, 9, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120};
    if (table->has("frequencies_Hz")) frequencies = table->numbers("frequencies_Hz", 1, 1000, {0.5, 2000});
    std::vector<double> currents;
    if (table->has("currents_A")) {
      if (table->has("current_A"))
        table->fail("current_A", "stands beside currents_A", "give one of the two");
      currents = table->numbers("currents_A", 1, 100, {1e-3, 1e4});
    } else {
      currents = {table->number_or("current_A", 1.5, {1e-3, 1e4})};
    }
    point.regulated = table->boolean_or("regulated", false);
    if (point.regulated) {
      point.tones.kp_V_per_A = table->number_or("kp_V_per_A", 1.6, {0, 1e4});
      point.tones.ki_V_per_As = table->number_or("ki_V_per_As", 116.0, {0, 1e6});
      point.tones.period_s = table->number_or("regulator_period_s", point.tones.period_s, {1e-6, 1.0});
    } else {
      point.ramp_s = table->number_or("ramp_s", 0.3, {0, 60});
    }
    for (const double f : frequencies) {
      for (const double current : currents) {
        point.frequency_Hz = f;
        point.level_A = current;
        if (point.regulated) {
          point.tones.amplitude_A = {current};
          point.tones.frequency_Hz = {f};
        }
        point.id = fmt::format("locked_f{}", in_id(f));
        if (currents.size() > 1) point.id += fmt::format("_i{}", in_id(current));
        add(*table, point);
      }
    }
  }

  // [grid], [steady], [no_load], [startup], [coast_down]: every frequency with every voltage, and every load
  // where there is one.
  void grid(const char* name, PointKind kind) {
    const auto table = file_.table_if(name);
    if (!table) return;
    const auto frequencies = table->numbers("frequencies_Hz", 1, 1000, {0.5, 2000});
    const auto voltages = table->numbers("voltages_percent", 1, 1000, {0.1, 200});
    PlanPoint point;
    point.kind = kind;
    read_times(*table, point);
    if (kind == PointKind::kStep) point.step = read_step(*table);
    if (kind == PointKind::kStartup) point.ramp_s = table->number_or("ramp_s", 0.0, {0, 60});
    const bool loaded = kind == PointKind::kStep || kind == PointKind::kSteady;
    const auto loads = loaded ? read_loads(*table) : std::vector<LoadChoice>{{LoadRequest{}, ""}};
    for (const double f : frequencies)
      for (const double v : voltages)
        for (const LoadChoice& load : loads) {
          point.frequency_Hz = f;
          point.voltage_percent = v;
          point.load = load.request;
          point.id = grid_id(kind, f, v, load.word);
          add(*table, point);
        }
  }

  void explicit_points() {
    for (const ConfigReader& table : file_.tables("point")) {
      PlanPoint point;
      point.kind = kind_of(table);
      read_times(table, point);
      if (point.kind == PointKind::kStep) point.step = read_step(table);
      if (point.kind == PointKind::kStartup) point.ramp_s = table.number_or("ramp_s", 0.0, {0, 60});
      point.frequency_Hz = table.number("frequency_Hz", {0.5, 2000});
      point.voltage_percent = table.number("voltage_percent", {0.1, 200});
      std::string word;
      if (point.kind == PointKind::kStep || point.kind == PointKind::kSteady)
        word = read_load(table, point.load);
      point.id = table.text_or("id", grid_id(point.kind, point.frequency_Hz, point.voltage_percent, word));
      if (table.boolean_or("holdout", false)) point.holdout = true;
      add(table, point);
    }
  }

 private:
  static PointKind kind_of(const ConfigReader& table) {
    const std::string word =
        table.choice_or("kind", {"step", "steady", "no_load", "startup", "coast_down"}, "step");
    return std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Named& n) { return n.word == word; })
        ->kind;
  }

  static double read_step(const ConfigReader& table) {
    const double percent = table.number_or("step_percent", 10.0, {-50, 50});
    if (percent == 0.0)
      table.fail("step_percent", "is 0", "a step record needs a step; ask for kind steady else");
    return percent / 100.0;
  }

  static std::string read_load(const ConfigReader& table, LoadRequest& load) {
    if (table.has("load_Nm")) {
      if (table.has("load_share")) table.fail("load_share", "stands beside load_Nm", "give one of the two");
      load.torque_Nm = table.number("load_Nm", {0, 1e5});
      return fmt::format("l{}Nm", in_id(load.torque_Nm));
    }
    load.share = table.number_or("load_share", 0.0, {0, 1});
    return fmt::format("l{}pc", in_id(100 * load.share));
  }

  void add(const ConfigReader& table, PlanPoint point) {
    if (point.id.empty() || point.id.size() > 80 ||
        point.id.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-") !=
            std::string::npos)
      table.fail("id", fmt::format("\"{}\" cannot name a record", point.id),
                 "letters, digits, _ . - and at most 80 of them");
    const long long repeats = table.integer_or("repeats", file_.integer_or("repeats", 1, {1, 100}), {1, 100});
    const std::string first = point.id;
    for (long long k = 1; k <= repeats; ++k) {
      if (k > 1) {
        point.id = fmt::format("{}_r{}", first, k);
        point.repeat_of = first;
      }
      if (!ids_.insert(point.id).second)
        table.fail("id", fmt::format("two points are called \"{}\"", point.id),
                   "give one of them another id");
      if (plan_.points.size() >= kMostPoints)
        table.fail("repeats", fmt::format("make more than {} points", kMostPoints));
      plan_.points.push_back(point);
    }
  }

  const ConfigReader& file_;
  Plan& plan_;
  std::set<std::string> ids_;
};

// Spreads the bits of a hash: ids that differ in their last letter alone must not stay neighbours (finalizer
// of MurmurHash3).
std::uint64_t spread(std::uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdull;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ull;
  return x ^ (x >> 33);
}

// Holdouts by list of ids, or a fraction of the step records, spread by a hash of the id so that the choice
// outlives edits elsewhere.
void mark_holdouts(const ConfigReader& file, Plan& plan) {
  if (file.has("holdout")) {
    if (file.has("holdout_fraction"))
      file.fail("holdout", "stands beside holdout_fraction", "give one of the two");
    for (const std::string& id : file.texts("holdout", 0, kMostPoints)) {
      bool found = false;
      for (PlanPoint& point : plan.points)
        if (point.id == id || point.repeat_of == id) found = point.holdout = true;
      if (!found)
        file.fail("holdout", fmt::format("no point is called \"{}\"", id),
                  "use the ids that `imrig campaign check` lists");
    }
    return;
  }
  const double fraction = file.number_or("holdout_fraction", 0.0, {0, 0.9});
  std::vector<std::pair<std::uint64_t, std::string>> steps;
  for (const PlanPoint& point : plan.points)
    if (point.kind == PointKind::kStep && point.repeat_of.empty())
      steps.emplace_back(spread(fnv1a64(point.id)), point.id);
  std::sort(steps.begin(), steps.end());
  std::set<std::string> chosen;
  const auto count = static_cast<std::size_t>(std::lround(fraction * static_cast<double>(steps.size())));
  for (std::size_t k = 0; k < count; ++k) chosen.insert(steps[k].second);
  for (PlanPoint& point : plan.points)
    if (chosen.contains(point.id) || chosen.contains(point.repeat_of)) point.holdout = true;
}

void read_limits(const ConfigReader& file, PlanLimits& limits) {
  const auto table = file.table_if("limits");
  if (!table) return;
  limits.current_A = table->number_or("current_A", limits.current_A, {1e-3, 1e6});
  limits.speed_rpm = table->number_or("speed_rpm", limits.speed_rpm, {1, 2e5});
  limits.pull_out_margin = table->number_or("pull_out_margin", limits.pull_out_margin, {0.05, 0.95});
  limits.slip = table->number_or("slip", limits.slip, {1e-3, 0.9});
  limits.flux_percent = table->number_or("flux_percent", limits.flux_percent, {1, 1000});
  limits.trips_allowed = static_cast<int>(table->integer_or("trips_allowed", 0, {0, 20}));
}

void read_motion(const ConfigReader& file, Motion& motion) {
  const auto table = file.table_if("motion");
  if (!table) return;
  motion.frequency_ramp_Hz_per_s =
      table->number_or("frequency_ramp_Hz_per_s", motion.frequency_ramp_Hz_per_s, {0.1, 1e4});
  motion.voltage_ramp_V_per_s =
      table->number_or("voltage_ramp_V_per_s", motion.voltage_ramp_V_per_s, {0.1, 1e5});
  motion.unload_s = table->number_or("unload_s", motion.unload_s, {0, 60});
}

}  // namespace

std::string_view point_kind_word(PointKind kind) {
  for (const Named& named : kKinds)
    if (named.kind == kind) return named.word;
  return "free";
}

bool begins_at_rest(PointKind kind) { return stays_at_rest(kind) || kind == PointKind::kStartup; }

bool stays_at_rest(PointKind kind) {
  return kind == PointKind::kDc || kind == PointKind::kStandstill || kind == PointKind::kLockedSweep;
}

Plan parse_plan(const std::string& text, const std::string& name) {
  const ConfigReader file = ConfigReader::from_text(text, name);
  file.integer("version", {1, 1});
  Plan plan;
  plan.name = file.text("name");
  plan.description = file.text_or("description", "");
  if (plan.name.empty() || plan.name.size() > 80) file.fail("name", "is empty or longer than 80 characters");
  read_limits(file, plan.limits);
  read_motion(file, plan.motion);
  Expansion expansion(file, plan);
  expansion.dc();
  expansion.standstill();
  expansion.locked_sweep();
  expansion.grid("startup", PointKind::kStartup);
  expansion.grid("no_load", PointKind::kNoLoad);
  expansion.grid("steady", PointKind::kSteady);
  expansion.grid("grid", PointKind::kStep);
  expansion.explicit_points();
  expansion.grid("coast_down", PointKind::kCoastDown);
  mark_holdouts(file, plan);
  file.finish();
  if (plan.points.empty())
    throw Error(name, "holds no point",
                "give it [dc], [standstill], [locked_sweep], [startup], [no_load], [steady], [grid], "
                "[coast_down] or [[point]]");
  plan.hash = fnv1a64(text);
  return plan;
}

Plan load_plan(const std::string& path) { return parse_plan(read_text(path, 1u << 20), path); }

}  // namespace imrig
