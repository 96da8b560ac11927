#pragma once
// A machine that is no induction motor, at the ratings of one: synchronous, with magnets or with a rotor of two
// reluctances,
//   psi' = v - R_s i,   i_d = (psi_d - psi_m)/L_d,  i_q = psi_q/L_q   in the rotor's frame,
// turning with the supply at a load angle, or held at rest.

#include <cstdint>
#include <string>

#include "bench/hidden/machine.h"
#include "rig/base/space_vector.h"
#include "rig/data/record.h"

namespace imrig::bench {

struct OtherMachine {
  double R_s, L_d, L_q, psi_m;
};
OtherMachine other_machine(const std::string& name, const Machine& machine);  // throws Error

// A record at frequency f with a step of the voltage up and down again; `load` 0..1 of the pull-out angle,
// locked at a chosen angle where `locked`.
Record other_record(const OtherMachine& other, const Machine& machine, double f_Hz, double flux, double load,
                    bool locked, const Noise& noise, double sample_time_s, double length_s, std::uint64_t seed);

}  // namespace imrig::bench
