#pragma once
// The value of a scalar, and whether it carries derivatives: what a branch may depend on.

#include <type_traits>

namespace imrig::est {

template <class T>
double value_of(const T& x) {
  if constexpr (std::is_floating_point_v<T>) {
    return x;
  } else {
    return x.a;
  }
}

template <class T>
bool has_derivative(const T& x) {
  if constexpr (std::is_floating_point_v<T>) {
    return false;
  } else {
    return (x.v.array() != 0.0).any();
  }
}

// Whether any of n amplitudes, neutral at zero, has an effect or carries a derivative.
template <class T>
bool live(const T* amplitudes, int n) {
  for (int k = 0; k < n; ++k) {
    if (value_of(amplitudes[k]) != 0.0 || has_derivative(amplitudes[k])) return true;
  }
  return false;
}

}  // namespace imrig::est
