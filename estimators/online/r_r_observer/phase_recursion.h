#pragma once
// Phase of the voltage ahead of the current by recursive least squares (Proca and Keyhani 2002, appendix).
// With the current as reference, sin(wt) = i_d/I and cos(wt) = i_q/I, the voltage of one axis is
//   y_n = v_d/V = sin(wt + phi) = h_n theta,  h_n = [sin wt, cos wt],  theta = [cos phi, sin phi]'
//   P_n^-1 = P_{n-1}^-1 + h_n' h_n,  theta_n = theta_{n-1} + P_n h_n' (y_n - h_n theta_{n-1})
// and phi = atan2(theta_2, theta_1). (The paper prints theta the other way round, and takes the arc cosine of
// theta_1 over the norm, which loses the sign.) A phase order a-c-b turns the reference the other way: phi
// changes its sign.

#include <cmath>
#include <complex>

namespace imrig::est {

class PhaseRecursion {
 public:
  void restart() { *this = {}; }
  // Vectors of the same instant, neither zero.
  void take(std::complex<double> v, std::complex<double> i) {
    const double I = std::sqrt(std::norm(i));
    const double sine = i.imag() / I, cosine = i.real() / I, y = v.imag() / std::sqrt(std::norm(v));
    p_11_ += sine * sine;
    p_12_ += sine * cosine;
    p_22_ += cosine * cosine;
    const double determinant = p_11_ * p_22_ - p_12_ * p_12_;
    if (determinant < kLeast) {  // one direction seen so far: the sums alone, until the inverse exists
      b_1_ += sine * y;
      b_2_ += cosine * y;
      return;
    }
    if (!started_) {
      b_1_ += sine * y;
      b_2_ += cosine * y;
      theta_1_ = (p_22_ * b_1_ - p_12_ * b_2_) / determinant;
      theta_2_ = (p_11_ * b_2_ - p_12_ * b_1_) / determinant;
      started_ = true;
      return;
    }
    const double innovation = y - sine * theta_1_ - cosine * theta_2_;
    theta_1_ += (p_22_ * sine - p_12_ * cosine) / determinant * innovation;
    theta_2_ += (p_11_ * cosine - p_12_ * sine) / determinant * innovation;
  }
  bool ready() const { return started_; }
  // Voltage ahead of current, for a vector that turns a-b-c.
  double phi_rad() const { return std::atan2(theta_2_, theta_1_); }

 private:
  static constexpr double kLeast = 1e-3;
  double p_11_ = 0.0, p_12_ = 0.0, p_22_ = 0.0;  // P^-1
  double b_1_ = 0.0, b_2_ = 0.0;
  double theta_1_ = 0.0, theta_2_ = 0.0;
  bool started_ = false;
};

}  // namespace imrig::est
