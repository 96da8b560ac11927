#include "estimators/diagnose/failure_map.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "estimators/diagnose/condition_bins.h"
#include "estimators/diagnose/shuffle_test.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewestUnits = 8;

// What is shuffled: a stretch, or a record by its means.
struct Unit {
  std::size_t record = 0;
  std::vector<double> conditions;  // in the order of kNames
  double log_size = kMissing;
  std::vector<double> signed_errors;
};

const std::vector<std::string> kNames{"f_Hz",      "psi_Wb",   "slip",   "i_A",
                                      "torque_Nm", "stator_C", "time_s", "direction"};

// Figures without the sense of rotation, which is a condition of its own.
std::vector<double> conditions_of(const Stretch& s) {
  const Conditions& c = s.conditions;
  const double turns = std::isfinite(c.f_Hz) ? c.f_Hz : c.speed_rad_s;
  const double direction = turns > 0.0 ? 1.0 : turns < 0.0 ? -1.0 : kMissing;
  const double torque = std::isnan(direction) ? c.torque_Nm : direction * c.torque_Nm;
  return {std::abs(c.f_Hz), c.psi_Wb, c.slip, c.i_A, torque, c.stator_C, s.time_s, direction};
}

// Every kind of signed error that some stretch has: not all records measure torque.
std::vector<Stretch::Signed> names_of(const std::vector<const std::vector<Stretch>*>& records) {
  std::vector<Stretch::Signed> out;
  for (const auto* record : records) {
    for (const Stretch& s : *record) {
      for (const Stretch::Signed& e : s.signed_errors) {
        const bool known = std::any_of(out.begin(), out.end(), [&](const Stretch::Signed& n) {
          return n.channel == e.channel && n.part == e.part;
        });
        if (!known) out.push_back(e);
      }
    }
  }
  return out;
}

Unit unit_of(const Stretch& s, std::size_t record, const std::vector<Stretch::Signed>& names) {
  Unit out{record, conditions_of(s), kMissing, std::vector<double>(names.size(), kMissing)};
  for (std::size_t k = 0; k < names.size(); ++k) {
    for (const Stretch::Signed& e : s.signed_errors) {
      if (e.channel == names[k].channel && e.part == names[k].part) out.signed_errors[k] = e.error;
    }
  }
  const auto found = s.channels.find("current_A");
  if (found == s.channels.end() || found->second.values == 0) return out;
  const ChannelResult& c = found->second;
  const double each = std::isnan(c.chi2) ? c.error2 / static_cast<double>(c.values) : c.chi2 / c.dof;
  out.log_size = std::log(std::max(each, 1e-300));
  return out;
}

// Mean of what is finite.
double mean(const std::vector<Unit>& units, const auto& figure) {
  double sum = 0.0, n = 0.0;
  for (const Unit& u : units) {
    const double x = figure(u);
    if (std::isfinite(x)) sum += x, n += 1.0;
  }
  return n > 0.0 ? sum / n : kMissing;
}

Unit averaged(const std::vector<Unit>& of_record) {
  Unit out{of_record.front().record, {}, kMissing, {}};
  for (std::size_t c = 0; c < kNames.size(); ++c)
    out.conditions.push_back(mean(of_record, [c](const Unit& u) { return u.conditions[c]; }));
  out.log_size = mean(of_record, [](const Unit& u) { return u.log_size; });
  for (std::size_t k = 0; k < of_record.front().signed_errors.size(); ++k)
    out.signed_errors.push_back(mean(of_record, [k](const Unit& u) { return u.signed_errors[k]; }));
  return out;
}

// Records that follow one another on one clock have a time; others only their order in the set.
bool one_clock(const std::vector<const std::vector<Stretch>*>& records) {
  double last = -1e300;
  for (const auto* record : records) {
    if (record->empty()) continue;
    if (!(record->front().time_s > last)) return false;
    last = record->back().time_s;
  }
  return true;
}

std::vector<int> bins_of(const std::vector<Unit>& units, std::size_t condition) {
  std::vector<double> values;
  for (const Unit& u : units) values.push_back(u.conditions[condition]);
  return condition_bins(values);
}

std::vector<MapBin> map_bins(const std::vector<Unit>& units, const std::vector<const Stretch*>& stretches,
                             std::size_t condition) {
  const std::vector<int> bins = bins_of(units, condition);
  const int last = bins.empty() ? -1 : *std::max_element(bins.begin(), bins.end());
  if (last < 1) return {};
  std::vector<MapBin> out(static_cast<std::size_t>(last) + 1);
  std::vector<std::set<std::size_t>> records(out.size());
  for (std::size_t k = 0; k < units.size(); ++k) {
    if (bins[k] < 0) continue;
    const auto at = static_cast<std::size_t>(bins[k]);
    MapBin& bin = out[at];
    bin.low = std::fmin(bin.low, units[k].conditions[condition]);
    bin.high = std::fmax(bin.high, units[k].conditions[condition]);
    ++bin.stretches;
    records[at].insert(units[k].record);
    for (const auto& [name, c] : stretches[k]->channels) add_sums(bin.channels[name], c);
  }
  for (std::size_t at = 0; at < out.size(); ++at) {
    out[at].records = records[at].size();
    for (auto& [name, c] : out[at].channels) finish(c);
  }
  return out;
}

// A figure of the units that may depend on a condition.
struct Figure {
  std::string channel, part;
  std::vector<double> values;
};

// An empty cell takes the middle, which says nothing; a figure that most units lack is none.
bool filled(std::vector<double>& values) {
  std::vector<double> known;
  for (const double x : values) {
    if (std::isfinite(x)) known.push_back(x);
  }
  if (2 * known.size() < values.size() || known.empty()) return false;
  const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  for (double& x : values) x = std::isfinite(x) ? x : *middle;
  return true;
}

std::vector<Figure> figures_of(const std::vector<Unit>& units, const std::vector<Stretch::Signed>& names) {
  std::vector<Figure> out{{"current_A", "size", {}}};
  for (const auto& name : names) out.push_back({name.channel, name.part.empty() ? "sign" : name.part, {}});
  for (const Unit& u : units) {
    out[0].values.push_back(u.log_size);
    for (std::size_t k = 0; k < names.size(); ++k) out[k + 1].values.push_back(u.signed_errors[k]);
  }
  std::erase_if(out, [](Figure& f) { return !filled(f.values); });
  return out;
}

void test(std::vector<Unit> units, const std::vector<Stretch::Signed>& names, Shuffle how, std::uint64_t seed,
          FailureMap& map) {
  std::erase_if(units, [](const Unit& u) { return !std::isfinite(u.log_size); });
  if (units.size() < kFewestUnits) {
    map.shuffled.clear();
    return;
  }
  const std::vector<Figure> figures = figures_of(units, names);
  std::vector<std::vector<double>> values;
  for (const Figure& f : figures) values.push_back(f.values);
  std::vector<std::vector<int>> groups;
  std::vector<MapCondition*> tested;
  for (std::size_t c = 0; c < kNames.size(); ++c) {
    std::vector<int> bins = bins_of(units, c);
    if (map.conditions[c].bins.empty() || *std::max_element(bins.begin(), bins.end()) < 1) continue;
    groups.push_back(std::move(bins));
    tested.push_back(&map.conditions[c]);
  }
  const std::vector<Dependence> found = shuffle_test(values, groups, how, seed);
  for (std::size_t k = 0; k < tested.size(); ++k) {
    tested[k]->p_value = found[k].p_value;
    tested[k]->share = found[k].share;
    tested[k]->channel = figures[found[k].figure].channel;
    tested[k]->part = figures[found[k].figure].part;
  }
}

}  // namespace

FailureMap failure_map(const std::vector<const std::vector<Stretch>*>& records, const std::string& from,
                       std::uint64_t seed) {
  FailureMap out;
  out.from = from;
  const bool points = from == "points", clock = !points && one_clock(records);
  std::vector<Unit> units, by_record;
  std::vector<const Stretch*> stretches;
  const std::vector<Stretch::Signed> names = names_of(records);
  for (std::size_t r = 0; r < records.size(); ++r) {
    std::vector<Unit> own;
    for (const Stretch& s : *records[r]) {
      own.push_back(unit_of(s, r, names));
      if (!clock) own.back().conditions[6] = static_cast<double>(points ? units.size() + own.size() : r + 1);
      stretches.push_back(&s);
    }
    if (own.empty()) continue;
    ++out.records;
    by_record.push_back(averaged(own));
    units.insert(units.end(), own.begin(), own.end());
  }
  out.stretches = units.size();
  for (std::size_t c = 0; c < kNames.size(); ++c) {
    MapCondition condition;
    condition.name = c == 6 && !clock ? "order" : kNames[c];
    condition.bins = map_bins(units, stretches, c);
    out.conditions.push_back(std::move(condition));
  }
  const bool whole_records = by_record.size() >= kFewestUnits;
  out.shuffled = points ? "points" : whole_records ? "records" : "stretches";
  if (stretches.empty()) return out;
  test(points || !whole_records ? units : by_record, names,
       points || whole_records ? Shuffle::kFree : Shuffle::kCircle, seed, out);
  return out;
}

}  // namespace imrig::est
