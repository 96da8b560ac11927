#include "estimators/diagnose/repeat_floor.h"

#include <algorithm>
#include <cmath>

#include "estimators/diagnose/channel.h"

namespace imrig::est {

namespace {

// Mean over the samples that all repeats have; at(r, k) is the residual of repeat r at sample k of the
// series.
template <class T, class At>
double scatter(std::size_t repeats, std::size_t begin, std::size_t end, At at) {
  double sum = 0.0;
  for (std::size_t k = begin; k < end; ++k) {
    T mean{};
    for (std::size_t r = 0; r < repeats; ++r) mean += at(r, k);
    mean /= static_cast<double>(repeats);
    for (std::size_t r = 0; r < repeats; ++r) sum += std::norm(std::complex<double>(at(r, k) - mean));
  }
  return sum / static_cast<double>((repeats - 1) * (end - begin));
}

// scale: real values per sample.
void set_floor(ChannelResult& channel, double variance, double scale) {
  channel.noise2 = variance * static_cast<double>(channel.values);
  channel.chi2 = scale * channel.error2 / variance;
  finish(channel);
}

}  // namespace

void set_floor_from_repeats(const std::vector<const Residual*>& residuals,
                            const std::vector<ComparedRecord*>& records) {
  std::size_t begin = 0, end = SIZE_MAX;
  for (const auto* residual : residuals) {
    begin = std::max(begin, residual->first);
    end = std::min(end, residual->first + residual->current.size());
  }
  if (residuals.size() < 2 || end < begin + 16) return;
  const auto current = [&](std::size_t r, std::size_t k) {
    return residuals[r]->current[k - residuals[r]->first];
  };
  const auto power = [&](std::size_t r, std::size_t k) {
    return residuals[r]->power[k - residuals[r]->first];
  };
  const double current2 = scatter<std::complex<double>>(residuals.size(), begin, end, current);
  const double power2 = scatter<double>(residuals.size(), begin, end, power);
  for (auto* record : records) {
    set_floor(record->channels["current_A"], current2, 2.0);
    set_floor(record->channels["input_power_W"], power2, 1.0);
    for (Stretch& stretch : record->stretches) {
      set_floor(stretch.channels["current_A"], current2, 2.0);
      set_floor(stretch.channels["input_power_W"], power2, 1.0);
    }
    record->floor_from = "repeats";
  }
}

}  // namespace imrig::est
