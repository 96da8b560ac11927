#pragma once
// What both heatings use: a resistance's factor (1 + per_K (T_stator - reference)) (1 + warmth), with p = (per_K,
// reference) of the motor and q = (warmth) of the record. Without a measured temperature the first part is 1.

#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
T temperature_factor(const T* p, const T* q, const Instant& at) {
  const T rise = at.stator_C == kUnknown_C ? T(0.0) : at.stator_C - p[1];
  return (1.0 + p[0] * rise) * (1.0 + q[0]);
}

}  // namespace imrig::est
