#pragma once
// Online observer of the rotor resistance, sample by sample (Proca and Keyhani 2002, appendix):
//   frequency   zero crossings of i_alpha and i_beta over a window of whole periods (zero_crossings.h)
//   slip        w_s = w_e - n_p w_M, from the window's mean speed
//   filter      the current passes the voltage channel's first-order filter, so that both are late and small alike
//   V, I        means of |v| and |i|; only their ratio enters
//   phase       recursive least squares (phase_recursion.h), anew in each window
//   steady      steady_criterion.h over consecutive windows
//   R_r         rotor_resistance.h, and from it R_1(T) (rotor_tracker.h)
// Nothing is allocated. Depends on the samples and their order alone. A window that is not steady, slips too
// little or has no real root gives no R_r, and says why.

#include <algorithm>
#include <complex>
#include <cstdint>
#include <limits>
#include <optional>

#include "estimators/online/matched_filter.h"
#include "estimators/online/r_r_observer/phase_recursion.h"
#include "estimators/online/r_r_observer/rotor_resistance.h"
#include "estimators/online/r_r_observer/rotor_tracker.h"
#include "estimators/online/steady_criterion.h"
#include "estimators/online/zero_crossings.h"

namespace imrig::est {

struct RotorObserverConfig {
  int pole_pairs = 2;
  double sample_time_s = 60e-6;
  double voltage_filter_s = 0.0;  // time constant that the current is given here; 0: none
  double behind_filter_s = 0.0;   // time constant that both have when they come in (the current by the caller)
  RotorCircuit circuit;
  double k_6_ohm_s = 0.0;    // of R_r = R_1 + k_6 |w_s|
  double settle_s = 0.0;     // of R_1; 0: the newest window alone
  double least_slip = 0.02;  // the paper's
  double window_s = 0.2;     // shortest; longer for two periods
  bool voltage_held = false;  // from sample to sample: what that does to both channels is undone (held_voltage.h)
  double longest_s = 4.0;    // a window without two periods by then is given up
};

struct RotorEstimate {
  std::int64_t first_index = 0, last_index = 0;  // of the window
  RotorResistanceStatus status = RotorResistanceStatus::kNotSteady;
  double frequency_Hz = 0.0;  // signed by the phase order
  double slip = 0.0;
  double w_s_rad_s = 0.0;                   // electrical
  double voltage_V = 0.0, current_A = 0.0;  // peak, behind the filter
  double phi_rad = 0.0;                     // voltage ahead of current, whatever the phase order
  double R_r_ohm = std::numeric_limits<double>::quiet_NaN();
  double R_1_ohm = std::numeric_limits<double>::quiet_NaN();  // tracked; known after the first valid window
  double sensitivity = 0.0;                                   // |d ln R_r/d ln a|
  bool upper_root = false;
  // One sigma, from the scatter within the window alone.
  double sigma_voltage_V = 0.0, sigma_current_A = 0.0, sigma_slip = 0.0;
};

class RotorObserver {
 public:
  // Throws Error on a configuration out of range.
  explicit RotorObserver(const RotorObserverConfig& config);

  // One sample, V, A, mechanical rad/s (NaN: not measured). Something when it closes a window.
  std::optional<RotorEstimate> take(std::complex<double> v, std::complex<double> i, double speed_rad_s);
  // For the windows that end from now on: R_s has warmed.
  void set_circuit(const RotorCircuit& circuit) { config_.circuit = circuit; }
  // Samples are missing or the gates switched: the window begins anew, the filter too. R_1 stays.
  void interrupt(std::int64_t next_index);

  const RotorTracker& tracker() const { return tracker_; }

 private:
  struct Train {
    double first = 0.0, last = 0.0;
    int count = 0;
    void take(double at);
    double periods() const { return count > 1 ? count - 1 : 0; }
  };
  // Of one window.
  struct Sums {
    std::int64_t samples = 0;
    double V = 0.0, V2 = 0.0, I = 0.0, I2 = 0.0, speed = 0.0, sense = 0.0;
    Train alpha, beta;
    bool speed_known = true;
  };

  void count_crossings(std::complex<double> i);
  bool whole() const;
  RotorEstimate close();
  OperatingPoint point_of(const RotorEstimate& e) const;
  void begin();

  RotorObserverConfig config_;
  RotorTracker tracker_;
  SteadyCriterion steady_;
  PhaseRecursion phase_;
  ZeroCrossings along_, across_;
  Sums sums_;
  std::int64_t next_index_ = 0, first_index_ = 0;
  std::int64_t skip_ = 0;  // samples until the filter has forgotten its start
  MatchedFilter filter_;
  double level_A_ = 0.0;
};

}  // namespace imrig::est
