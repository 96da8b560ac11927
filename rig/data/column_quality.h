#pragma once
// What can be seen on a single column, before phases become vectors. Sentences without a subject, empty if
// nothing was found.

#include <string>
#include <vector>

namespace imrig {

// "sits at its largest value 35.0 in 412 of 5000 samples, up to 60 in a row: clipped?". A signal is held to
// be clipped when it stays at an extreme for four samples or more, and is in the outermost 2 % of its half
// range six times as often as in the next 2 %: a sine is 2.4 times.
std::string clipped(const std::vector<double>& x);

// "do not sum to zero: ..." when the sum's rms passes 10 % of the largest column's.
std::string uneven_sum(const std::vector<double>& a, const std::vector<double>& b,
                       const std::vector<double>& c);

}  // namespace imrig
