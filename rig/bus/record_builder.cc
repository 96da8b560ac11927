#include "rig/bus/record_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "rig/base/file.h"
#include "rig/bus/series_columns.h"
#include "rig/bus/speed_from_counts.h"

namespace imrig {

namespace {

using Blocks = std::vector<SampleBlock>;

// Sorted by index, each sample once: the blocks' new parts, `skip` samples into the block.
struct Part {
  const imrig_msg::samples_t* block;
  std::int64_t skip;
  std::int64_t n() const { return block->n - skip; }
};

struct Ordered {
  std::vector<Part> parts;
  std::int64_t samples = 0;
  std::int64_t first_missing = -1;  // index of the first sample of the first gap
};

Ordered in_order(Blocks& blocks) {
  std::stable_sort(blocks.begin(), blocks.end(),
                   [](const auto& a, const auto& b) { return a->first_index < b->first_index; });
  Ordered out;
  std::int64_t expected = blocks.front()->first_index;
  for (const auto& block : blocks) {
    if (block->first_index > expected && out.first_missing < 0) out.first_missing = expected;
    const std::int64_t skip = std::max<std::int64_t>(0, expected - block->first_index);
    if (skip >= block->n) continue;  // a duplicate
    out.parts.push_back({block.get(), skip});
    out.samples += out.parts.back().n();
    expected = block->first_index + block->n;
  }
  return out;
}

bool same_facts(const imrig_msg::samples_t& a, const imrig_msg::samples_t& b) {
  return a.sample_time_ns == b.sample_time_ns && a.current_A_per_count == b.current_A_per_count &&
         a.voltage_V_per_count == b.voltage_V_per_count && a.voltage_filter_s == b.voltage_filter_s &&
         a.full_scale_counts == b.full_scale_counts && a.encoder_counts_per_rev == b.encoder_counts_per_rev;
}

// Why the blocks are no record; empty when they are.
std::string fault_of(const RawRecord& raw, const Ordered& ordered) {
  const auto& first = *raw.blocks.front();
  for (const auto& block : raw.blocks) {
    if (block->boot_id != first.boot_id) return "the device was restarted within it";
    if (!same_facts(*block, first)) return "scales or sample time change within it";
  }
  const std::int64_t lost = raw.end->samples - ordered.samples;
  if (lost > 0) {
    std::string text =
        std::to_string(lost) + " of its " + std::to_string(raw.end->samples) + " samples are missing";
    if (ordered.first_missing >= 0) text += ", the first at index " + std::to_string(ordered.first_missing);
    return text;
  }
  if (ordered.first_missing >= 0)
    return "its samples have a gap at index " + std::to_string(ordered.first_missing);
  return "";
}

const std::vector<std::int16_t>& column(const imrig_msg::samples_t& block, std::size_t channel) {
  const std::array<const std::vector<std::int16_t>*, kChannels> columns = {
      &block.i_a, &block.i_b, &block.i_c, &block.v_a, &block.v_b, &block.v_c};
  return *columns[channel];
}

void append_values(TimeSeries& out, const Part& part, const SensorZero& zero) {
  const auto& b = *part.block;
  const auto i_scale = static_cast<double>(b.current_A_per_count);
  const auto v_scale = static_cast<double>(b.voltage_V_per_count);
  const auto& z = zero.counts;
  for (auto k = static_cast<std::size_t>(part.skip); k < static_cast<std::size_t>(b.n); ++k) {
    out.i.push_back(i_scale * space_vector(b.i_a[k] - z[kIa], b.i_b[k] - z[kIb], b.i_c[k] - z[kIc]));
    out.v.push_back(v_scale * space_vector(b.v_a[k] - z[kVa], b.v_b[k] - z[kVb], b.v_c[k] - z[kVc]));
  }
  const auto n = static_cast<std::size_t>(part.n());
  out.segment.insert(out.segment.end(), n, b.segment);
  out.gates_on.insert(out.gates_on.end(), n, b.gates_on != 0 ? 1 : 0);
  out.stator_C.insert(out.stator_C.end(), n, static_cast<double>(b.stator_C));
}

// Counts over the margins and the record, without a gap.
std::vector<double> speed_of(const RawRecord& raw, const Ordered& ordered) {
  const auto& facts = *ordered.parts.front().block;
  if (facts.encoder_counts_per_rev <= 0) return {};
  std::vector<std::int32_t> counts;
  for (const auto& block : raw.before)
    counts.insert(counts.end(), block->encoder.begin(), block->encoder.end());
  const bool joined =
      !raw.before.empty() && raw.before.back()->first_index + raw.before.back()->n == facts.first_index;
  if (!joined) counts.clear();  // an earlier block of the record came late
  const std::size_t first = counts.size();
  for (const auto& part : ordered.parts) {
    counts.insert(counts.end(), part.block->encoder.begin() + part.skip, part.block->encoder.end());
  }
  std::int64_t end = facts.first_index + ordered.samples;
  for (const auto& block : raw.after) {
    if (block->first_index != end) break;
    counts.insert(counts.end(), block->encoder.begin(), block->encoder.end());
    end += block->n;
  }
  return speed_from_counts(unwrap_counts(counts), first, static_cast<std::size_t>(ordered.samples),
                           static_cast<double>(facts.sample_time_ns) * 1e-9, facts.encoder_counts_per_rev);
}

void warn_of_clipping(Record& record, const Ordered& ordered) {
  constexpr std::array<const char*, kChannels> kNames = {"current a", "current b", "current c",
                                                         "voltage a", "voltage b", "voltage c"};
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::int64_t clipped = 0;
    for (const auto& part : ordered.parts) {
      const auto& counts = column(*part.block, c);
      clipped += std::count_if(counts.begin() + part.skip, counts.end(), [&](std::int16_t x) {
        return std::abs(int{x}) >= part.block->full_scale_counts;
      });
    }
    if (clipped > 0) {
      record.warnings.push_back(std::string(kNames[c]) + " is at the converter's full scale in " +
                                std::to_string(clipped) + " of " + std::to_string(ordered.samples) +
                                " samples");
    }
  }
}

class RawHash {
 public:
  template <class T>
  void add(const T* values, std::size_t n) {
    value_ = fnv1a64({reinterpret_cast<const char*>(values), n * sizeof(T)}, value_);
  }
  template <class T>
  void number(T x) {
    add(&x, 1);
  }
  void text(const std::string& word) {
    number(word.size());
    add(word.data(), word.size());
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = fnv1a64("imrig counts 1");
};

std::uint64_t hash_of_counts(const Record& record, const Ordered& ordered) {
  const auto& facts = *ordered.parts.front().block;
  RawHash hash;
  hash.text(record.id);
  hash.text(record_kind_word(record.kind));
  hash.number(record.holdout);
  hash.text(record.repeat_of);
  hash.number(facts.sample_time_ns);
  hash.number(facts.current_A_per_count);
  hash.number(facts.voltage_V_per_count);
  hash.number(facts.voltage_filter_s);
  hash.number(facts.encoder_counts_per_rev);
  for (const auto& part : ordered.parts) {
    const auto skip = static_cast<std::size_t>(part.skip);
    const auto n = static_cast<std::size_t>(part.n());
    hash.number(part.block->segment);
    hash.number(part.block->gates_on != 0);
    hash.number(part.block->stator_C);
    for (std::size_t c = 0; c < kChannels; ++c) hash.add(column(*part.block, c).data() + skip, n);
    hash.add(part.block->encoder.data() + skip, n);
  }
  return hash.value();
}

void build_from_samples(RawRecord& raw, const SensorZero& zero, BuiltRecord& out, Record record) {
  const Ordered ordered = in_order(raw.blocks);
  out.reason = fault_of(raw, ordered);
  if (!out.reason.empty()) return;
  TimeSeries& series = record.series;
  const auto& facts = *ordered.parts.front().block;
  series.sample_time_s = static_cast<double>(facts.sample_time_ns) * 1e-9;
  series.first_index = facts.first_index;
  series.voltage_filter_s = static_cast<double>(facts.voltage_filter_s);
  const auto n = static_cast<std::size_t>(ordered.samples);
  series.v.reserve(n);
  series.i.reserve(n);
  for (const auto& part : ordered.parts) append_values(series, part, zero);
  if (std::all_of(series.stator_C.begin(), series.stator_C.end(), [](double x) { return std::isnan(x); }))
    series.stator_C.clear();
  series.speed_rad_s = speed_of(raw, ordered);
  if (series.speed_rad_s.empty()) record.warnings.emplace_back("no encoder: the record has no speed");
  if (ordered.samples > raw.end->samples) {
    record.warnings.push_back("the log holds " + std::to_string(ordered.samples) + " samples, " +
                              std::to_string(raw.end->samples) + " were announced");
  }
  warn_of_clipping(record, ordered);
  out.from_samples = true;
  out.raw_hash = hash_of_counts(record, ordered);
  out.record = std::move(record);
}

Record facts_of(const imrig_msg::record_t& begin, RecordKind kind) {
  Record record;
  record.id = begin.id;
  record.kind = kind;
  record.holdout = begin.holdout != 0;
  record.repeat_of = begin.repeat_of;
  record.set = {begin.set_frequency_Hz, begin.set_voltage_V, begin.set_step, begin.set_load_Nm,
                begin.set_excitation_A};
  return record;
}

std::string fault_of_messages(const RawRecord& raw) {
  if (!raw.end) return "it has no end; the log or the campaign stopped within it";
  if (raw.end->status != imrig_msg::record_t::COMPLETE) return "it was aborted";
  if (raw.end->id != raw.begin.id) return "its end message names another record, " + raw.end->id;
  if (raw.blocks.empty() && raw.series.empty() && raw.points.empty())
    return "there are no samples of it in the log";
  if (!raw.blocks.empty() && !(raw.series.empty() && raw.points.empty()))
    return "it has both measured and imported samples";
  return "";
}

}  // namespace

BuiltRecord build_record(RawRecord& raw, const SensorZero& zero) {
  BuiltRecord out;
  out.reason = fault_of_messages(raw);
  const auto kind = record_kind_from(raw.begin.kind);
  if (out.reason.empty() && !kind) out.reason = "its kind \"" + raw.begin.kind + "\" is unknown";
  if (!out.reason.empty()) return out;
  Record record = facts_of(raw.begin, *kind);
  record.warnings = raw.remarks;
  if (!raw.blocks.empty()) {
    build_from_samples(raw, zero, out, std::move(record));
  } else {
    out.reason = join_columns(raw, record);
    if (out.reason.empty()) out.record = std::move(record);
  }
  for (auto* blocks : {&raw.blocks, &raw.before, &raw.after}) Blocks().swap(*blocks);
  return out;
}

}  // namespace imrig
