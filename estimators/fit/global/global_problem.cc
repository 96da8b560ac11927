#include "estimators/fit/global/global_problem.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/each.h"
#include "estimators/fit/global/noise_bias.h"
#include "estimators/fit/global/settle.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kTableShare =
    0.003;  // what a table is good for: of the value, and of the largest where nothing is declared
constexpr double kLargestShare = 5e-4;
constexpr double kRounding_rad_s = 0.03;  // a whole number of turns a minute

bool simulated(RecordKind kind) { return kind != RecordKind::kDc; }

struct Temperatures {
  double mean = kMissing, spread = 0.0;
};

Temperatures temperatures(const DataSet& data) {
  double sum = 0.0, low = 1e9, high = -1e9;
  std::size_t n = 0;
  const auto take = [&](double t) {
    if (!std::isfinite(t)) return;
    sum += t;
    ++n;
    low = std::min(low, t);
    high = std::max(high, t);
  };
  for (const Record& record : data.records) {
    if (record.kind == RecordKind::kDc) continue;
    for (std::size_t k = 0; k < record.series.stator_C.size(); k += 64) take(record.series.stator_C[k]);
    for (const SteadyPoint& p : record.points) take(p.stator_C);
  }
  return n == 0 ? Temperatures{} : Temperatures{sum / static_cast<double>(n), high - low};
}

// NaN where neither it nor the shaft's power was measured.
double shaft_torque_Nm(const SteadyPoint& p) {
  return std::isfinite(p.torque_Nm) ? p.torque_Nm : p.p_out_W / std::max(1.0, std::abs(p.speed_rad_s));
}

// Sigma of each channel: declared, else a share of the largest value; a speed is rounded at least.
PointNoise point_noise(const DataSet& data) {
  double current = 0.0, power = 0.0, torque = 0.0;
  for (const Record& record : data.records) {
    for (const SteadyPoint& p : record.points) {
      const double T = shaft_torque_Nm(p);
      if (std::isfinite(p.i_peak_A)) current = std::max(current, p.i_peak_A);
      if (std::isfinite(p.p_in_W)) power = std::max(power, std::abs(p.p_in_W));
      if (std::isfinite(T)) torque = std::max(torque, std::abs(T));
    }
  }
  const auto either = [](double declared, double largest) {
    return std::isfinite(declared) && declared > 0.0 ? declared : kLargestShare * largest;
  };
  PointNoise out;
  out.current_A = either(std::sqrt(2.0) * data.noise.current_A, current);
  out.power_W = either(data.noise.power_W, power);
  out.torque_Nm = either(data.noise.torque_Nm, torque);
  out.speed_rad_s = std::isfinite(data.noise.speed_rad_s) ? data.noise.speed_rad_s : kRounding_rad_s;
  out.relative = kTableShare;
  return out;
}

}  // namespace

GlobalProblem::GlobalProblem(const DataSet& data, const MachineParameters<double>& theta, int threads,
                             double longest_sample_s, bool judge_torque)
    : data_(data),
      threads_(std::max(1, threads)),
      noise_(noise_levels(data)),
      point_noise_(point_noise(data)),
      rounding_(imrig::speed_rounding(data)) {
  const Temperatures t = temperatures(data);
  mean_stator_C_ = t.mean;
  spread_stator_C_ = t.spread;
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    const Record& record = data.records[k];
    if (!simulated(record.kind)) continue;
    Entry entry;
    entry.index = k;
    entry.id = record.id;
    entry.holdout = record.holdout;
    entry.record = &record;
    try {
      if (record.kind != RecordKind::kPoints) {
        entry.series =
            std::make_unique<DrivenRecord>(driven_record(record.series, data.pole_pairs, longest_sample_s));
        if (rounding_.of_record[k]) entry.series->speed_sigma = speed_sigma();
        const FrameRecord& frame = entry.series->frame;
        if (judge_torque)
          entry.series->torque = torque_windows(record.series.torque_Nm, frame, entry.series->thinned);
        sample_time_ = std::max(sample_time_, record.series.sample_time_s);
        for (std::size_t n = frame.judged_from; n < frame.size(); ++n) {
          largest_current_ = std::max(largest_current_, std::abs(frame.i[n]));
          if (std::abs(frame.w_k) > 30.0)
            largest_flux_ =
                std::max(largest_flux_, std::abs((frame.v[n] - theta.R_s * frame.i[n]) / frame.w_k));
        }
      }
      if (!record.points.empty()) {
        add_rows(k);
        continue;
      }
      entries_.push_back(std::move(entry));
    } catch (const Error& e) {
      left_out_.push_back({record.id, e.what()});
    }
  }
  weigh_torque(theta.R_s);
  if (entries_.empty())
    throw Error("data set \"" + data.name + "\"", "has no record that can be simulated",
                left_out_.empty() ? "" : left_out_.front().why);
  SharedVector<double> rough = start({}).shared;
  rough[0] = theta.R_s;
  rough[1] = theta.R_r;
  rough[2] = theta.L_l;
  rough[3] = theta.L_m;
  refresh(rough);
}

void GlobalProblem::weigh_torque(double R_s_ohm) {
  std::vector<const TorqueWindow*> windows;
  double largest_Nm = 0.0;
  for (const Entry& entry : entries_) {
    for (std::size_t w = 0; entry.series && w < entry.series->torque.size(); ++w)
      windows.push_back(&entry.series->torque[w]);
  }
  torque_refused_ = torque_contradiction(windows, R_s_ohm);
  for (Entry& entry : entries_) {
    if (entry.series && !torque_refused_.empty()) entry.series->torque.clear();
    if (entry.series) largest_Nm = std::max(largest_Nm, torque_range_Nm(entry.series->torque));
  }
  for (Entry& entry : entries_) {
    if (entry.series) weigh(entry.series->torque, largest_Nm, data_.noise.torque_Nm);
  }
  torque_of_series_ = largest_Nm > 0.0;
  torque_ = torque_ || torque_of_series_;
  largest_torque_Nm_ = std::max(largest_torque_Nm_, largest_Nm);
}

// Each row of a table is an experiment of its own.
void GlobalProblem::add_rows(std::size_t index) {
  const Record& record = data_.records[index];
  for (std::size_t n = 0; n < record.points.size(); ++n) {
    const SteadyPoint& p = record.points[n];
    const std::string id = fmt::format("{}, row {}", record.id, n + 1);
    try {
      predict_steady(start({}).shared, data_.pole_pairs, p);
    } catch (const Error& e) {
      left_out_.push_back({id, e.what()});
      continue;
    }
    Entry entry;
    entry.index = index;
    entry.id = id;
    entry.holdout = record.holdout;
    entry.record = &record;
    entry.point = {p};
    entries_.push_back(std::move(entry));
    if (p.f_Hz > 5.0) largest_flux_ = std::max(largest_flux_, p.v_peak_V / (2.0 * kPi * p.f_Hz));
    if (std::isfinite(p.i_peak_A)) largest_current_ = std::max(largest_current_, p.i_peak_A);
    const double torque_Nm = shaft_torque_Nm(p);
    torque_ = torque_ || std::isfinite(torque_Nm);
    if (std::isfinite(torque_Nm)) largest_torque_Nm_ = std::max(largest_torque_Nm_, std::abs(torque_Nm));
  }
}

void GlobalProblem::refresh(const SharedVector<double>& shared) {
  const MachineParameters<double> theta{shared[0], shared[1], shared[2], shared[3]};
  for (Entry& entry : entries_) {
    if (!entry.series) continue;
    entry.steps = steps_for(*entry.series, shared);
    entry.whitener = std::make_unique<Whitener>(*entry.series, theta, 0.8 * largest_flux_, noise_.levels);
  }
}

GlobalProblem::GlobalProblem(const GlobalProblem& other)
    : data_(other.data_),
      threads_(other.threads_),
      noise_(other.noise_),
      point_noise_(other.point_noise_),
      left_out_(other.left_out_),
      mean_stator_C_(other.mean_stator_C_),
      spread_stator_C_(other.spread_stator_C_),
      largest_flux_(other.largest_flux_),
      largest_current_(other.largest_current_),
      sample_time_(other.sample_time_),
      rounding_(other.rounding_),
      largest_torque_Nm_(other.largest_torque_Nm_),
      torque_refused_(other.torque_refused_),
      torque_(other.torque_),
      torque_of_series_(other.torque_of_series_) {
  for (const Entry& e : other.entries_) {
    entries_.push_back({e.index, e.id, e.holdout, e.record, e.point,
                        e.series ? std::make_unique<DrivenRecord>(*e.series) : nullptr,
                        e.whitener ? std::make_unique<Whitener>(*e.whitener) : nullptr, e.steps});
  }
}

double GlobalProblem::speed_sigma() const { return data_.pole_pairs * rounding_.sigma_rad_s; }

GlobalProblem GlobalProblem::without_torque() const {
  GlobalProblem out(*this);
  for (Entry& entry : out.entries_) {
    if (entry.series) entry.series->torque.clear();
  }
  return out;
}

GlobalProblem GlobalProblem::with(std::vector<DrivenRecord> more, const SharedVector<double>& shared,
                                  const std::vector<NoiseLevels>& noise) const {
  GlobalProblem out(*this);
  const MachineParameters<double> theta{shared[0], shared[1], shared[2], shared[3]};
  for (std::size_t k = 0; k < more.size(); ++k) {
    Entry entry;
    entry.series = std::make_unique<DrivenRecord>(std::move(more[k]));
    entry.steps = steps_for(*entry.series, shared);
    entry.whitener = std::make_unique<Whitener>(*entry.series, theta, 0.8 * largest_flux_, noise[k]);
    out.entries_.push_back(std::move(entry));
  }
  return out;
}

namespace {

// Of a record that nobody has taken: where a torque would be judged, whatever it is.
std::vector<TorqueWindow> torque_windows_of_any(const DrivenRecord& record) {
  const auto samples = record.frame.first + record.size() * static_cast<std::size_t>(record.thinned);
  return torque_windows(std::vector<double>(samples, 0.0), record.frame, record.thinned);
}

}  // namespace

void GlobalProblem::pretend(const GlobalPoint& at) {
  each(entries_.size(), threads_, [&](std::size_t k) {
    Entry& entry = entries_[k];
    for (SteadyPoint& p : entry.point) {
      const PointPrediction model = predict_steady(at.shared, data_.pole_pairs, p);
      const auto put = [](double& measured, double predicted) {
        if (std::isfinite(measured)) measured = predicted;
      };
      put(p.i_peak_A, model.i_peak_A);
      put(p.p_in_W, model.p_in_W);
      put(p.torque_Nm, model.torque_Nm);
      put(p.p_out_W, model.p_out_W);
    }
    if (!entry.series) return;
    RecordTrace trace;
    evaluate_one(k, at.shared, at.local[k], {}, &trace);
    FrameRecord& frame = entry.series->frame;
    for (std::size_t n = frame.judged_from; n < frame.size(); ++n)
      frame.i[n] -= trace.error[n - frame.judged_from];
    const bool planned = entry.record == nullptr;
    if (planned && torque_of_series_) entry.series->torque = torque_windows_of_any(*entry.series);
    if (entry.series->torque.empty()) return;
    RecordTrace again;  // of the current that is there now
    evaluate_one(k, at.shared, at.local[k], {}, &again);
    for (std::size_t w = 0; w < again.torque_Nm.size(); ++w)
      entry.series->torque[w].mean_Nm = again.torque_Nm[w];
    if (planned) weigh(entry.series->torque, largest_torque_Nm_, data_.noise.torque_Nm);
  });
}

GlobalPoint GlobalProblem::start(const SharedVector<double>& shared) const {
  GlobalPoint out;
  out.shared = shared;
  if (shared[0] == 0.0) {
    out.shared = {0.5, 0.5, 0.01, 0.1};
    for (std::size_t entry = kBase; entry < kShared; ++entry)
      out.shared[entry] = shared_parameter(entry).neutral;
  }
  out.local.assign(entries_.size(), neutral_local());
  return out;
}

std::vector<std::size_t> GlobalProblem::locals_of(std::size_t entry,
                                                  const std::vector<std::size_t>& local) const {
  return entries_[entry].series ? local : std::vector<std::size_t>{};
}

RecordTerms GlobalProblem::evaluate_one(std::size_t number, const SharedVector<double>& shared,
                                        const LocalVector<double>& local, const Lanes& lanes,
                                        RecordTrace* trace) const {
  const Entry& entry = entries_[number];
  if (!entry.series) return points_terms(entry.point, data_.pole_pairs, point_noise_, shared, lanes);
  return record_terms(*entry.series, *entry.whitener, entry.steps, shared, local, lanes, trace);
}

GlobalTerms GlobalProblem::evaluate(const GlobalPoint& at, const Freedom& free,
                                    const std::vector<std::size_t>& which,
                                    const std::vector<Prior>& priors) const {
  GlobalTerms out;
  const auto s = static_cast<Eigen::Index>(free.shared.size());
  out.normal.setZero(s, s);
  out.gradient.setZero(s);
  out.records.resize(which.size());
  each(which.size(), threads_, [&](std::size_t k) {
    out.records[k] =
        evaluate_one(which[k], at.shared, at.local[which[k]], {free.shared, locals_of(which[k], free.local)});
  });
  for (std::size_t k = 0; k < which.size(); ++k) {
    RecordTerms& r = out.records[k];
    const auto locals = locals_of(which[k], free.local);
    const auto l = static_cast<Eigen::Index>(locals.size());
    add_local_priors(locals, at.local[which[k]], s, r);
    out.chi2 += r.chi2;
    out.values += r.values;
    Eigen::VectorXd score = r.gradient.head(s);
    Eigen::MatrixXd normal = r.normal.topLeftCorner(s, s);
    if (l > 0 && s > 0) {
      Eigen::MatrixXd D = r.normal.bottomRightCorner(l, l);
      D.diagonal() *= 1.0 + 1e-10;
      D.diagonal().array() += 1e-12;
      const Eigen::MatrixXd B = r.normal.topRightCorner(s, l);
      const Eigen::LDLT<Eigen::MatrixXd> ldlt(D);
      normal -= B * ldlt.solve(B.transpose());
      score -= B * ldlt.solve(r.gradient.tail(l));
    }
    out.normal += normal;
    out.gradient += score;
    out.scores.push_back(std::move(score));
    out.normals.push_back(std::move(normal));
  }
  for (const Prior& prior : priors) {
    const double off = (at.shared[prior.entry] - prior.value) / prior.sigma;
    out.chi2 += off * off;
    const auto found = std::find(free.shared.begin(), free.shared.end(), prior.entry);
    if (found == free.shared.end()) continue;
    const auto m = static_cast<Eigen::Index>(found - free.shared.begin());
    out.normal(m, m) += 1.0 / (prior.sigma * prior.sigma);
    out.gradient[m] += off / prior.sigma;
  }
  return out;
}

void GlobalProblem::settle(GlobalPoint& at, const std::vector<std::size_t>& local,
                           const std::vector<std::size_t>& which) const {
  each(which.size(), threads_, [&](std::size_t w) {
    const Entry& entry = entries_[which[w]];
    if (entry.series)
      settle_record(*entry.series, *entry.whitener, entry.steps, at.shared, local, at.local[which[w]]);
  });
}

Eigen::VectorXd GlobalProblem::noise_gradient(const GlobalPoint& at, const std::vector<std::size_t>& entries,
                                              const std::vector<std::size_t>& which) const {
  std::vector<Eigen::VectorXd> parts(which.size());
  each(which.size(), threads_, [&](std::size_t k) {
    const Entry& entry = entries_[which[k]];
    parts[k].setZero(static_cast<Eigen::Index>(entries.size()));
    if (entry.series)
      parts[k] =
          est::noise_gradient(*entry.series, *entry.whitener, entry.steps, at.shared, entries, noise_.levels);
  });
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(entries.size()));
  for (const Eigen::VectorXd& part : parts) sum += part;
  return sum;
}

std::vector<std::size_t> GlobalProblem::fitted() const {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    if (!entries_[k].holdout) out.push_back(k);
  }
  return out;
}

std::vector<std::size_t> GlobalProblem::holdout() const {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    if (entries_[k].holdout) out.push_back(k);
  }
  return out;
}

std::vector<std::size_t> GlobalProblem::all() const {
  std::vector<std::size_t> out(entries_.size());
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = k;
  return out;
}

}  // namespace imrig::est
