#include "estimators/fit/standstill/standstill_fit.h"

#include <fmt/format.h>

#include <cmath>

#include "estimators/fit/standstill/standstill_judgement.h"

namespace imrig::est {

namespace {

using standstill::Judgement;
using standstill::Prior;
using standstill::Search;

constexpr double kUnseen = 1e3;  // amplification: 0.1 % of misfit is as large as the parameter

std::string cannot_separate(const StandstillFit& fit, const StandstillFitOptions& options) {
  std::string names;
  for (std::size_t k = 0; k < kStandstillParameters; ++k) {
    const bool flat = !(fit.amplification[k] <= options.most_amplification);
    const bool noisy = !(fit.sigma[k] <= options.most_relative_sigma);
    if (!flat && !noisy) continue;
    names += names.empty() ? "" : ", ";
    if (!(fit.amplification[k] <= kUnseen)) {
      names += fmt::format("{} (not seen at all)", kStandstillNames[k]);
    } else if (flat) {
      names += fmt::format("{} (0.1 % of misfit moves it by {:.2g} %)", kStandstillNames[k],
                           0.1 * fit.amplification[k]);
    } else {
      names += fmt::format("{} (sigma {:.2g} %)", kStandstillNames[k], 100.0 * fit.sigma[k]);
    }
  }
  if (names.empty()) return "";
  return "cannot separate " + names +
         ": excite with two frequencies or more, one of them near R_r/L_m or below";
}

}  // namespace

StandstillFit fit_standstill(const AxisRecord& record, const StandstillFitOptions& options) {
  StandstillFit fit;
  fit.failure = record.failure;
  if (!fit.failure.empty()) return fit;
  const Search found = standstill::search(record, options);
  fit.iterations = found.iterations;
  if (!std::isfinite(found.cost)) {
    fit.failure = "no start of the search suits the sample time";
    return fit;
  }
  Judgement alone(record, options, found);
  alone.fill(fit);
  bool settled = found.settled;
  if (options.R_s) {
    const Prior prior = alone.prior_of(*options.R_s, fit);
    const Search both = standstill::search_with(record, found.at, prior);
    settled = both.settled;
    Judgement(record, options, both, prior).fill(fit);
  }
  fit.failure = cannot_separate(fit, options);
  if (fit.failure.empty() && !settled) fit.failure = "the fit does not settle";
  return fit;
}

}  // namespace imrig::est
