#include "estimators/diagnose/condition_bins.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

constexpr double kHardly = 0.02;  // of the largest magnitude: less variation is none
constexpr double kGap = 0.05;     // of the span: values further apart are different settings
constexpr std::size_t kMostClusters = 7, kParts = 6, kFewest = 4;

bool hardly_varies(double low, double high) {
  return !(high - low > kHardly * std::max(std::abs(low), std::abs(high)));
}

// First entries of clusters, in sorted values; those of too few values join the one below.
std::vector<std::size_t> clusters(const std::vector<double>& sorted) {
  const std::size_t n = sorted.size(), fewest = std::clamp<std::size_t>(n / kFewest, 1, kFewest);
  const double span = sorted.back() - sorted.front();
  std::vector<std::size_t> starts{0};
  for (std::size_t k = 1; k < n; ++k) {
    if (sorted[k] - sorted[k - 1] > kGap * span && k - starts.back() >= fewest && n - k >= fewest)
      starts.push_back(k);
  }
  return starts.size() > kMostClusters ? std::vector<std::size_t>{0} : starts;
}

// Starts of parts of equal count between two entries.
void add_parts(const std::vector<double>& sorted, std::size_t begin, std::size_t end,
               std::vector<double>& starts) {
  std::size_t parts = ((end - begin) * kParts + sorted.size() / 2) / sorted.size();
  if (hardly_varies(sorted[begin], sorted[end - 1])) parts = 1;
  parts = std::clamp<std::size_t>(
      parts, 1,
      std::max<std::size_t>(1, (end - begin) / std::min<std::size_t>(kFewest, sorted.size() / 2 + 1)));
  for (std::size_t k = 0; k < parts; ++k) {
    const double start = sorted[begin + k * (end - begin) / parts];
    if (starts.empty() || start > starts.back()) starts.push_back(start);
  }
}

}  // namespace

std::vector<int> condition_bins(const std::vector<double>& values) {
  std::vector<double> sorted;
  for (const double x : values) {
    if (std::isfinite(x)) sorted.push_back(x);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> starts;
  if (!sorted.empty() && !hardly_varies(sorted.front(), sorted.back())) {
    std::vector<std::size_t> edges = clusters(sorted);
    edges.push_back(sorted.size());
    for (std::size_t k = 0; k + 1 < edges.size(); ++k) add_parts(sorted, edges[k], edges[k + 1], starts);
  } else if (!sorted.empty()) {
    starts.push_back(sorted.front());
  }
  std::vector<int> out;
  for (const double x : values) {
    const auto above = std::upper_bound(starts.begin(), starts.end(), x);
    out.push_back(std::isfinite(x) ? static_cast<int>(above - starts.begin()) - 1 : -1);
  }
  return out;
}

}  // namespace imrig::est
