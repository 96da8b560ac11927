#pragma once
// Real 2x2 matrices on the components of space vectors.

#include <complex>

namespace imrig::plant {

struct Matrix2 {
  double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0;
};

struct Symmetric2 {
  double xx = 0.0, xy = 0.0, yy = 0.0;
};

inline Matrix2 operator+(const Matrix2& a, const Matrix2& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.yx + b.yx, a.yy + b.yy};
}
inline Matrix2 operator-(const Matrix2& a, const Matrix2& b) {
  return {a.xx - b.xx, a.xy - b.xy, a.yx - b.yx, a.yy - b.yy};
}
inline Matrix2 operator*(double f, const Matrix2& a) { return {f * a.xx, f * a.xy, f * a.yx, f * a.yy}; }
inline Matrix2 operator*(const Matrix2& a, const Matrix2& b) {
  return {a.xx * b.xx + a.xy * b.yx, a.xx * b.xy + a.xy * b.yy, a.yx * b.xx + a.yy * b.yx,
          a.yx * b.xy + a.yy * b.yy};
}
inline std::complex<double> operator*(const Matrix2& a, std::complex<double> x) {
  return {a.xx * x.real() + a.xy * x.imag(), a.yx * x.real() + a.yy * x.imag()};
}
inline Matrix2 transposed(const Matrix2& a) { return {a.xx, a.yx, a.xy, a.yy}; }
inline Matrix2 inverse(const Matrix2& a) {
  const double f = 1.0 / (a.xx * a.yy - a.xy * a.yx);
  return {f * a.yy, -f * a.xy, -f * a.yx, f * a.xx};
}

inline Symmetric2 operator+(const Symmetric2& a, const Symmetric2& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.yy + b.yy};
}
inline Symmetric2 operator*(double f, const Symmetric2& a) { return {f * a.xx, f * a.xy, f * a.yy}; }
inline std::complex<double> operator*(const Symmetric2& a, std::complex<double> x) {
  return {a.xx * x.real() + a.xy * x.imag(), a.xy * x.real() + a.yy * x.imag()};
}
inline Symmetric2 inverse(const Symmetric2& a) {
  const double f = 1.0 / (a.xx * a.yy - a.xy * a.xy);
  return {f * a.yy, -f * a.xy, f * a.xx};
}

}  // namespace imrig::plant
