#include "rig/data/quantities.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "rig/data/folder.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using Phasor = std::complex<double>;

// Three equal windings of impedance Z in delta, fed by a balanced supply, solved by Kirchhoff alone.
struct DeltaCircuit {
  Phasor Z{3.0, 6.0};
  std::array<Phasor, 3> v;          // terminals to the supply's neutral
  std::array<Phasor, 3> v_line;     // ab, bc, ca
  std::array<Phasor, 3> i_winding;  // ab, bc, ca
  std::array<Phasor, 3> i_line;     // a, b, c

  DeltaCircuit() {
    for (int k = 0; k < 3; ++k) v[static_cast<std::size_t>(k)] = std::polar(100.0, 0.3 - 2.0 * kPi / 3.0 * k);
    for (std::size_t k = 0; k < 3; ++k) v_line[k] = v[k] - v[(k + 1) % 3];
    for (std::size_t k = 0; k < 3; ++k) i_winding[k] = v_line[k] / Z;
    for (std::size_t k = 0; k < 3; ++k) i_line[k] = i_winding[k] - i_winding[(k + 2) % 3];
  }
  static SpaceVector at(const std::array<Phasor, 3>& x, double angle) {
    const Phasor turn = std::polar(1.0, angle);
    return space_vector((x[0] * turn).real(), (x[1] * turn).real(), (x[2] * turn).real());
  }
};

TEST(Quantities, EveryWayToMeasureADeltaMotorGivesTheSameStar) {
  const DeltaCircuit c;
  for (const double angle : {0.0, 0.7, 2.9}) {
    const SpaceVector v = DeltaCircuit::at(c.v, angle);
    const SpaceVector i = DeltaCircuit::at(c.i_line, angle);
    EXPECT_NEAR(std::abs(v / i - c.Z / 3.0), 0.0, 1e-12)
        << "the equivalent star has a third of the winding's impedance";
    const Wiring line{true, Quantities::kLine}, phase{true, Quantities::kPhase};
    EXPECT_NEAR(std::abs(DeltaCircuit::at(c.v_line, angle) * voltage_to_star(line) - v), 0.0, 1e-12);
    EXPECT_NEAR(std::abs(DeltaCircuit::at(c.i_line, angle) * current_to_star(line) - i), 0.0, 1e-12);
    EXPECT_NEAR(std::abs(DeltaCircuit::at(c.v_line, angle) * voltage_to_star(phase) - v), 0.0, 1e-12);
    EXPECT_NEAR(std::abs(DeltaCircuit::at(c.i_winding, angle) * current_to_star(phase) - i), 0.0, 1e-12);
  }
}

TEST(Quantities, LineVoltagesOfAStarMotorBecomePhaseVoltages) {
  const DeltaCircuit c;
  const Wiring line{false, Quantities::kLine};
  EXPECT_NEAR(std::abs(DeltaCircuit::at(c.v_line, 0.4) * voltage_to_star(line) - DeltaCircuit::at(c.v, 0.4)),
              0.0, 1e-12);
  EXPECT_EQ(current_to_star(line), SpaceVector(1.0, 0.0));
  EXPECT_EQ(voltage_to_star({false, Quantities::kPhase}), SpaceVector(1.0, 0.0));
}

TEST(Quantities, PowerIsTheSameInEveryForm) {
  const DeltaCircuit c;
  double watts = 0.0;
  for (std::size_t k = 0; k < 3; ++k) watts += 0.5 * (c.v_line[k] * std::conj(c.i_winding[k])).real();
  const Wiring phase{true, Quantities::kPhase};
  EXPECT_NEAR(power_W(DeltaCircuit::at(c.v_line, 0.1) * voltage_to_star(phase),
                      DeltaCircuit::at(c.i_winding, 0.1) * current_to_star(phase)),
              watts, 1e-9);
}

TEST(Quantities, NoiseOfCellsBecomesNoiseOfVectorComponents) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  double three = 0.0, two = 0.0;
  const int draws = 200000;
  for (int k = 0; k < draws; ++k) {
    const double a = noise(random), b = noise(random), c = noise(random);
    three += std::norm(space_vector(a, b, c)) / 2.0;
    two += std::norm(space_vector(a, b, -a - b)) / 2.0;
  }
  EXPECT_NEAR(std::sqrt(three / draws), cell_to_component(NoiseOf::kThreePhases), 0.01);
  EXPECT_NEAR(std::sqrt(two / draws), cell_to_component(NoiseOf::kTwoPhases), 0.01);
  EXPECT_EQ(cell_to_component(NoiseOf::kRms), std::numbers::sqrt2);
}

// The same delta motor, written by four laboratories.
DataSet lab(const std::string& quantities, const std::string& kind, const std::array<Phasor, 3>& v,
            const std::array<Phasor, 3>& i) {
  test::Scratch folder;
  std::string csv = kind == "abc" ? "v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,i_c_A,speed_rpm\n"
                                  : "v_alpha_V,v_beta_V,i_alpha_A,i_beta_A,speed_rpm\n";
  char text[400];
  for (int k = 0; k < 100; ++k) {
    const double angle = 2.0 * kPi * 0.01 * k;
    const Phasor turn = std::polar(1.0, angle);
    if (kind == "abc") {
      std::snprintf(text, sizeof text, "%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,1450\n", (v[0] * turn).real(),
                    (v[1] * turn).real(), (v[2] * turn).real(), (i[0] * turn).real(), (i[1] * turn).real(),
                    (i[2] * turn).real());
    } else {
      const auto vv = DeltaCircuit::at(v, angle), ii = DeltaCircuit::at(i, angle);
      std::snprintf(text, sizeof text, "%.17g,%.17g,%.17g,%.17g,1450\n", vv.real(), vv.imag(), ii.real(),
                    ii.imag());
    }
    csv += text;
  }
  folder.write("r1.csv", csv);
  folder.write("dataset.toml", test::manifest("noise = { current_A = 0.1, voltage_V = 1.0 }\n" +
                                                  std::string(test::kOneRecord) + "sample_time_s = 2e-4\n",
                                              "delta", quantities));
  return read_folder(folder.path());
}

TEST(Quantities, FourLabsReadTheSameRecord) {
  const DeltaCircuit c;
  const DataSet line = lab("line", "abc", c.v_line, c.i_line);
  const DataSet others[] = {lab("phase", "abc", c.v_line, c.i_winding),
                            lab("line", "alpha_beta", c.v_line, c.i_line),
                            lab("phase", "alpha_beta", c.v_line, c.i_winding)};
  for (const auto& other : others) {
    for (std::size_t k = 0; k < 100; ++k) {
      EXPECT_NEAR(std::abs(other.records[0].series.v[k] - line.records[0].series.v[k]), 0.0, 1e-10);
      EXPECT_NEAR(std::abs(other.records[0].series.i[k] - line.records[0].series.i[k]), 0.0, 1e-10);
    }
  }
  EXPECT_TRUE(line.delta);
  EXPECT_NEAR(line.noise.current_A, 0.1 * std::sqrt(2.0 / 3.0), 1e-12);
  EXPECT_NEAR(line.noise.voltage_V, 1.0 / std::sqrt(3.0) * std::sqrt(2.0 / 3.0), 1e-12);
  EXPECT_NEAR(others[0].noise.current_A, 0.1 * std::sqrt(3.0) * std::sqrt(2.0 / 3.0), 1e-12);
  EXPECT_NEAR(others[1].noise.current_A, 0.1, 1e-12);
}

}  // namespace
}  // namespace imrig
