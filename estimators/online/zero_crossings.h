#pragma once
// Rising zero crossings of a noisy signal, seen through a Schmitt trigger: armed below -threshold, complete
// above +threshold. The crossing is the zero of a least-squares line through the samples between the two. No
// memory but a few sums.

namespace imrig::est {

class ZeroCrossings {
 public:
  // Of the amplitude: a line is within 3 % of a sine up to there.
  static constexpr double kHysteresis = 0.4;

  explicit ZeroCrossings(double threshold = 0.0) : threshold_(threshold) {}
  void set_threshold(double threshold) { threshold_ = threshold; }

  // True at the sample that completes a crossing; at() then tells where, in the unit of k.
  bool take(double value, double k) {
    if (value < -threshold_) {
      armed_ = true;
      sums_ = {};
      return false;
    }
    if (!armed_) return false;
    sums_.add(value, k);
    if (value < threshold_) return false;
    armed_ = false;
    at_ = sums_.zero(k);
    return true;
  }
  double at() const { return at_; }

 private:
  // Straight line through the samples since the lower threshold. Counted from the first of them: k may be
  // large.
  struct Sums {
    double first = 0.0, n = 0.0, k = 0.0, kk = 0.0, v = 0.0, kv = 0.0;
    void add(double value, double at) {
      if (n == 0.0) first = at;
      const double x = at - first;
      n += 1.0;
      k += x;
      kk += x * x;
      v += value;
      kv += x * value;
    }
    double zero(double fallback) const {
      const double slope = (n * kv - k * v) / (n * kk - k * k);
      return n > 1.5 && slope > 0.0 ? first + (k - v / slope) / n : fallback;
    }
  };

  double threshold_;
  bool armed_ = false;
  Sums sums_;
  double at_ = 0.0;
};

}  // namespace imrig::est
