#pragma once
// Levenberg's and Marquardt's method over a standstill record, from the best of several starts.

#include <limits>

#include "estimators/fit/standstill/standstill_problem.h"

namespace imrig::est::standstill {

struct Search {
  Point at;
  double cost = std::numeric_limits<double>::infinity();
  bool settled = false;
  int iterations = 0;
};

// n: samples used.
Search descend(const AxisRecord& record, const Point& start, std::size_t n, int most,
               const Prior& prior = {});

// Starts of standstill_start.h and the nominal, ranked on the record's first part; the best ones over all of
// it.
Search search(const AxisRecord& record, const StandstillFitOptions& options);

// The whole record again from a point that another search found, with R_s from elsewhere.
Search search_with(const AxisRecord& record, const Point& start, const Prior& prior);

}  // namespace imrig::est::standstill
