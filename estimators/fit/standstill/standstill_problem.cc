#include "estimators/fit/standstill/standstill_problem.h"

#include <ceres/jet.h>

#include "estimators/fit/standstill/standstill_response.h"

namespace imrig::est::standstill {

MachineParameters<double> theta_of(const Point& p) {
  return {std::exp(p.log_theta[0]), std::exp(p.log_theta[1]), std::exp(p.log_theta[2]),
          std::exp(p.log_theta[3])};
}

Point point_of(const MachineParameters<double>& p) {
  Point out;
  out.log_theta << std::log(p.R_s), std::log(p.R_r), std::log(p.L_l), std::log(p.L_m);
  return out;
}

namespace {

using Jet = ceres::Jet<double, kTheta>;

MachineParameters<Jet> seeded(const Point& p) {
  const auto one = [&](int k) { return exp(Jet(p.log_theta[k], k)); };
  return {one(0), one(1), one(2), one(3)};
}

}  // namespace

bool steppable(const MachineParameters<double>& p, double h) {
  return h * (p.R_s / p.L_l + p.R_r / p.L_l + p.R_r / p.L_m) < kMostStep;
}

std::vector<Sums> evaluate(const AxisRecord& record, const Point& at, std::size_t n, std::size_t blocks,
                           std::vector<double>* kept) {
  const StandstillStep<Jet> step = standstill_step(seeded(at), record.sample_time_s);
  const StandstillStep<double> plain = standstill_step(theta_of(at), record.sample_time_s);
  StandstillState<Jet> x{Jet(at.psi_s), Jet(at.psi_r)};
  StandstillState<double> from_s{1.0, 0.0}, from_r{0.0, 1.0};
  std::vector<Sums> sums(blocks);
  Vector row;
  row[6] = 1.0;
  for (std::size_t k = 0; k < n; ++k) {
    const Jet i = x.current(step);
    row.head<kTheta>() = i.v;
    row[4] = from_s.current(plain);
    row[5] = from_r.current(plain);
    const double r = i.a + at.constant - record.i[k];
    sums[k * blocks / n].add(row, r);
    if (kept != nullptr) kept->push_back(r);
    if (k + 1 == n) break;
    x.advance(step, record.u[k], record.u[k + 1]);
    from_s.advance(plain, 0.0, 0.0);
    from_r.advance(plain, 0.0, 0.0);
  }
  for (Sums& s : sums) s.H.triangularView<Eigen::StrictlyUpper>() = s.H.transpose();
  return sums;
}

Sums whole(const std::vector<Sums>& blocks) {
  Sums sum;
  for (const Sums& b : blocks) sum += b;
  return sum;
}

}  // namespace imrig::est::standstill
