#pragma once
// A complex number over any scalar (double, ceres::Jet): std::complex is defined for floating-point types
// only, and its product checks for NaN at each step. Only what a linear machine model needs.

#include <complex>

namespace imrig::est {

template <class T>
struct Cx {
  T re{};
  T im{};
  Cx() = default;
  Cx(const T& real, const T& imaginary) : re(real), im(imaginary) {}
  explicit Cx(const std::complex<double>& z) : re(z.real()), im(z.imag()) {}
};

template <class T>
Cx<T> operator+(const Cx<T>& a, const Cx<T>& b) {
  return {a.re + b.re, a.im + b.im};
}
template <class T>
Cx<T> operator-(const Cx<T>& a, const Cx<T>& b) {
  return {a.re - b.re, a.im - b.im};
}
template <class T>
Cx<T> operator*(const Cx<T>& a, const Cx<T>& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
// S is the scalar itself or a plain double.
template <class S, class T>
Cx<T> scaled(const S& factor, const Cx<T>& a) {
  return {factor * a.re, factor * a.im};
}
template <class S, class T>
Cx<T> turned(const S& factor, const Cx<T>& a) {  // j factor a
  return {-(factor * a.im), factor * a.re};
}
template <class T>
Cx<T> conj(const Cx<T>& a) {
  return {a.re, -a.im};
}
template <class T>
T norm(const Cx<T>& a) {  // |a|^2
  return a.re * a.re + a.im * a.im;
}
template <class T>
Cx<T> operator/(const Cx<T>& a, const Cx<T>& b) {
  const T inverse = T(1.0) / norm(b);
  return scaled(inverse, a * conj(b));
}

inline std::complex<double> plain(const Cx<double>& a) { return {a.re, a.im}; }

}  // namespace imrig::est
