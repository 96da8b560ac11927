#pragma once
// A diagnosis that ends ambiguous names the experiment that would settle it. Here the sealed plant takes it,
// and diagnosis looks again at all records together.

#include <string>

#include "bench/hidden/sealed.h"
#include "estimators/diagnose/diagnose.h"

namespace imrig::bench {

struct FollowUp {
  std::string what;        // the experiment; empty: none was named
  bool reference = false;  // no record separates, it said
  double forecast = 0.0;   // of d
  // d of what was hidden from its nearest rival in the set, those left out that it said no record separates,
  // by what both leave of the real records: sqrt(chi2 of the rival - chi2 of the truth)/2; infinite where the
  // rival is no longer worth a try.
  double before = 0.0, after = 0.0;
  bool settled = false;  // what was hidden is named, without any of those rivals
  bool raised() const { return after > before; }
};

// first: of sealed.data, ambiguous, with the truth and a rival that is none in the set.
FollowUp follow_up(const Sealed& sealed, const est::Model& model, const est::Diagnosis& first,
                   const SealOptions& seal, int threads);

}  // namespace imrig::bench
