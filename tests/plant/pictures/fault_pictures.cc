#include <memory>

#include "plant/effects/broken_bar.h"
#include "plant/effects/eccentricity.h"
#include "plant/effects/shorted_turns.h"
#include "plant/effects/stator_unbalance.h"
#include "plant/effects/supply_unbalance.h"
#include "tests/plant/pictures/picture.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant::pictures {
namespace {

using namespace bench;
using EffectPtr = std::shared_ptr<const Effect>;

constexpr double kRpm = 1440.0;
const Supply kLine{50.0, 150.0};

PlantConfig machine(const EffectPtr& effect) {
  PlantConfig c = held_speed(kRpm);
  if (effect) c.effects = {effect};
  return c;
}

// Current vectors over `duration_s` after everything has died away.
std::vector<Complex> currents(const PlantConfig& config, double duration_s) {
  Plant plant(config);
  run(plant, kLine, 3.0);
  std::vector<Complex> i;
  const auto n = std::llround(duration_s / sample_s(plant));
  for (long long k = 0; k < n; ++k) {
    plant.step(kLine.at(plant));
    i.push_back(plant.state().i_s);
  }
  return i;
}

// Lines of the current below its fundamental, dB, cut at -80; a step is a bin of the window.
Series spectrum(const std::vector<Complex>& i, double from_Hz, double to_Hz, double step_Hz) {
  Series s;
  const auto amplitude = [&](double f_Hz) {
    Line line(f_Hz, 60e-6, static_cast<int>(i.size()));
    for (const Complex x : i) line.add(x);
    return line.amplitude();
  };
  const double base = amplitude(50.0);
  for (double f = from_Hz; f <= to_Hz + 1e-9; f += step_Hz)
    s.add(f, std::max(-80.0, 20.0 * std::log10(amplitude(f) / base)));
  return s;
}

Picture lines(const char* name, const char* title, const EffectPtr& effect, double from_Hz, double to_Hz,
              double step_Hz) {
  Picture p{name, title, "frequency, Hz", "of the fundamental, dB", {}};
  for (const auto& one : {EffectPtr(), effect}) {
    p.series.push_back(spectrum(currents(machine(one), 1.0 / step_Hz), from_Hz, to_Hz, step_Hz));
  }
  p.series[0].label = "healthy", p.series[0].dashed = true, p.series[1].label = "faulty";
  return p;
}

Picture locus(const char* name, const char* title, const EffectPtr& effect) {
  Picture p{name, title, "i alpha, A", "i beta, A", {}, true};
  for (const auto& one : {EffectPtr(), effect}) {
    Series s{one ? "unequal" : "equal phases", {}, {}, !one};
    const auto i = currents(machine(one), 0.02);
    for (std::size_t k = 0; k < i.size(); k += 3) s.add(i[k].real(), i[k].imag());
    s.add(i[0].real(), i[0].imag());
    p.series.push_back(std::move(s));
  }
  return p;
}

}  // namespace

std::vector<Picture> fault_pictures() {
  return {lines("broken_bar", "Stator current, 2 of 28 bars broken, slip 4 %",
                std::make_shared<BrokenBar>(BrokenBar::Config{2.0, 28.0}), 42.0, 58.0, 0.25),
          lines("eccentricity", "Stator current, eccentricity 0.3 static and 0.2 dynamic, shaft at 24 Hz",
                std::make_shared<Eccentricity>(Eccentricity::Config{0.3, 0.2}), 15.0, 85.0, 1.0),
          locus("supply_unbalance", "Phases a +5 %, b -5 %",
                std::make_shared<SupplyUnbalance>(SupplyUnbalance::Config{0.05, -0.05, 0.0})),
          locus("stator_unbalance", "Phase a with five times the resistance",
                std::make_shared<StatorUnbalance>(StatorUnbalance::Config{4.0, 0.0, 0.0})),
          locus("shorted_turns", "10 % of phase a's turns shorted, 0.02 ohm",
                std::make_shared<ShortedTurns>(ShortedTurns::Config{{0.1, 0.0, 0.0}, 0.02}))};
}

}  // namespace imrig::plant::pictures
