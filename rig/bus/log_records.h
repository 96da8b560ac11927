#pragma once
// An event log to records (docs/architecture.md, "Records"; docs/event-log.md). One pass, streaming; kept in
// memory are the records alone.
//
// A record is what lies between a RECORD begin and the END with the same number: blocks of SAMPLES that carry
// the number (campaign), or SERIES or POINTS (imrig import). Left out, with a note that names id and reason:
// aborted, no END, samples missing or of two device boots. A later whole record with the same id replaces the
// earlier one.
//
// Counts to units: x = scale (count - zero), per phase. Zeros and noise come from samples with gates off and
// the shaft at rest (sensor_zero.h); what a DATASET message declares comes before what is measured. Speed:
// speed_from_counts.h, with samples from outside the record where the log has them without a gap.

#include <string>

#include "rig/data/record.h"

namespace imrig {

// prefix: of the channels ("IMRIG"); empty: the one that has records. Other channels and types are ignored
// and counted in a note. Throws Error: no event log, no record of imrig in it, records of several prefixes
// and none asked for.
DataSet read_log(const std::string& path, const std::string& prefix = "");

}  // namespace imrig
