#pragma once
// Sums of outer products of rows, some dozens of rows at a time: what normal equations are made of.

#include <Eigen/Core>

namespace imrig::est {

template <int Columns>
class RowSums {
 public:
  using Row = Eigen::Matrix<double, Columns, 1>;
  // The next row, to be filled by the caller before anything else is asked.
  auto next() {
    if (filled_ == kBatch) flush();
    return rows_.col(filled_++);
  }
  void add(const Row& row) { next() = row; }
  // The sum so far, symmetric; the next one starts from zero.
  Eigen::MatrixXd take() {
    flush();
    Eigen::MatrixXd out = sum_.template selfadjointView<Eigen::Lower>();
    sum_.setZero();
    return out;
  }

 private:
  void flush() {
    if (filled_ == 0) return;
    sum_.template selfadjointView<Eigen::Lower>().rankUpdate(rows_.leftCols(filled_));
    filled_ = 0;
  }

  static constexpr int kBatch = 64;
  Eigen::Matrix<double, Columns, kBatch> rows_ = Eigen::Matrix<double, Columns, kBatch>::Zero();
  Eigen::MatrixXd sum_ = Eigen::MatrixXd::Zero(Columns, Columns);
  int filled_ = 0;
};

}  // namespace imrig::est
