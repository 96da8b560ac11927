#include "rig/data/folder.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/data/csv.h"
#include "rig/data/data_hash.h"
#include "rig/data/manifest.h"
#include "rig/data/mat.h"
#include "rig/data/points_reader.h"
#include "rig/data/quality.h"
#include "rig/data/series_reader.h"

namespace imrig {

namespace {

ColumnTable read_columns(const std::string& path) {
  return path.ends_with(".mat") ? read_mat(path) : read_csv(path);
}

// How the cells of a set were measured, for its one noise figure; time series come before tables.
struct NoiseSource {
  std::optional<NoiseOf> current, voltage;
  bool series = false, points = false;
};

void see(NoiseSource& source, NoiseOf current, NoiseOf voltage, bool series) {
  const bool first = !source.current || (series && !source.series);
  if (first) {
    source.current = current;
    source.voltage = voltage;
  }
  (series ? source.series : source.points) = true;
}

Record read_record(const RecordSpec& spec, Wiring wiring, NoiseSource& source, std::string& refused) {
  Record record;
  record.id = spec.id;
  record.kind = spec.kind;
  record.holdout = spec.holdout;
  record.repeat_of = spec.repeat_of;
  record.set = spec.set;
  const ColumnTable table = read_columns(spec.path);
  if (spec.kind == RecordKind::kPoints) {
    PointsRead read = read_points(spec, table, wiring);
    record.points = std::move(read.points);
    record.warnings = std::move(read.warnings);
    refused = read.refused;
    if (refused.empty()) see(source, read.noise, read.noise, false);
  } else {
    SeriesRead read = read_series(spec, table, wiring);
    record.series = std::move(read.series);
    record.warnings = std::move(read.warnings);
    refused = read.refused;
    if (refused.empty()) see(source, read.current, read.voltage, true);
  }
  return record;
}

Noise to_star(const Noise& cells, const NoiseSource& source, Wiring wiring) {
  const auto scaled = [](double sigma, SpaceVector to_star, NoiseOf kind) {
    const double factor =
        (to_star == SpaceVector{1.0, 0.0} ? 1.0 : std::abs(to_star)) * cell_to_component(kind);
    return factor == 1.0 ? sigma : sigma * factor;
  };
  Noise noise = cells;
  noise.current_A = scaled(cells.current_A, current_to_star(wiring), source.current.value_or(NoiseOf::kPeak));
  noise.voltage_V = scaled(cells.voltage_V, voltage_to_star(wiring), source.voltage.value_or(NoiseOf::kPeak));
  return noise;
}

}  // namespace

DataSet read_folder(const std::string& folder) {
  if (!std::filesystem::is_directory(folder))
    throw Error(folder, "is no folder", "a folder with a dataset.toml is needed");
  const std::string path = (std::filesystem::path(folder) / "dataset.toml").string();
  const Manifest manifest = parse_manifest(read_text(path, std::size_t{1} << 26), path,
                                           std::filesystem::path(folder).lexically_normal().string());
  DataSet data;
  data.name = manifest.name;
  data.pole_pairs = manifest.pole_pairs;
  data.delta = manifest.wiring.delta;
  data.accuracy = manifest.accuracy;
  NoiseSource source;
  for (const auto& spec : manifest.records) {
    std::string refused;
    Record record = read_record(spec, manifest.wiring, source, refused);
    if (refused.empty()) {
      data.records.push_back(std::move(record));
    } else {
      data.notes.push_back(fmt::format("record \"{}\" left out: {}", spec.id, refused));
    }
  }
  if (data.records.empty())
    throw Error(path, "holds no record that can be used", data.notes.empty() ? "" : data.notes.front());
  data.noise = to_star(manifest.cells, source, manifest.wiring);
  const bool mixed = source.series && source.points && !std::isnan(manifest.cells.current_A);
  if (mixed)
    data.notes.push_back(
        "the declared current and voltage noise is taken as one sample's of the time series, not of the "
        "points");
  add_quality_warnings(data);
  data.hash = hash_of(data);
  return data;
}

}  // namespace imrig
