#pragma once
// How the loaded model misses the motor, condition by condition, so that a drift shows while it runs. A condition
// is a cell of frequency, voltage and slip frequency; in it the misfit d = (I - I_model)/I, a complex share of the
// current, is followed over steady windows:
//   first    mean of the first kFirst windows          running   mean that forgets over kRunning windows
//   drift    |running - first|, with the scatter of single windows behind its interval
// A fixed number of cells; the one unseen for longest makes room.

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>

#include "estimators/online/quantity.h"

namespace imrig::est {

struct Condition {
  std::int32_t f_Hz = 0, v_V = 0, w_s_rad_s = 0;  // middles of the cell
  bool operator==(const Condition&) const = default;
};

inline Condition condition_of(double f_Hz, double v_V, double w_s_rad_s) {
  const auto middle = [](double x, double step) { return static_cast<std::int32_t>(std::lround(x / step) * std::lround(step)); };
  return {middle(f_Hz, 5.0), middle(v_V, 10.0), middle(w_s_rad_s, 2.0)};
}

class ConditionTable {
 public:
  static constexpr int kFirst = 10, kRunning = 20;
  static constexpr std::size_t kCells = 256;

  struct Cell {
    Condition at;
    std::int32_t windows = 0;
    std::int64_t last_index = -1;
    std::complex<double> first, running;
    double scatter = 0.0;  // mean |d - running|^2
    Quantity mean() const {
      return {std::abs(running), std::sqrt(scatter / std::min(windows, kRunning)), last_index};
    }
    // Known once the first windows are complete.
    Quantity drift() const {
      if (windows <= kFirst) return {};
      return {std::abs(running - first), std::sqrt(scatter * (1.0 / kFirst + 1.0 / kRunning)), last_index};
    }
  };

  const Cell& take(const Condition& at, std::complex<double> misfit, std::int64_t index) {
    Cell& cell = place(at);
    const double n = ++cell.windows;
    const std::complex<double> away = misfit - cell.running;
    if (cell.windows > 1) cell.scatter += (std::norm(away) - cell.scatter) / std::min(n - 1.0, double{kRunning});
    cell.running += away / std::min(n, double{kRunning});
    if (cell.windows <= kFirst) cell.first = cell.first + (misfit - cell.first) / n;
    cell.last_index = index;
    return cell;
  }
  void clear() { cells_ = {}; }

 private:
  Cell& place(const Condition& at) {
    Cell* oldest = cells_.data();
    for (Cell& cell : cells_) {
      if (cell.windows > 0 && cell.at == at) return cell;
      if (cell.last_index < oldest->last_index) oldest = &cell;
    }
    *oldest = {};
    oldest->at = at;
    return *oldest;
  }
  std::array<Cell, kCells> cells_{};
};

}  // namespace imrig::est
