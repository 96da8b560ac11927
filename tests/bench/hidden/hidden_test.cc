// The short version of the hidden-effect suite: the plant makes the data, diagnosis works blind, the seal is
// opened afterwards.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/hidden/score.h"
#include "bench/hidden/share.h"

namespace imrig::bench {
namespace {

constexpr SealOptions kShort{0.09, 4};

Outcome outcome_of(const char* name, std::uint64_t seed) {
  return score(make_sealed(cell(name), Strength::kMedium, seed, kShort));
}

void expect_named(const char* name, std::uint64_t seed) {
  const Outcome o = outcome_of(name, seed);
  ASSERT_EQ(o.failed, "");
  EXPECT_EQ(o.base_from, "identified");
  EXPECT_TRUE(o.set_holds_truth()) << o.verdict << " " << o.named;
  EXPECT_LT(o.chi2_after, o.chi2_before);
}

TEST(HiddenEffects, NothingIsFoundWhereNothingIsHidden) {
  const Outcome o = outcome_of("nothing", 1);
  ASSERT_EQ(o.failed, "");
  EXPECT_EQ(o.verdict, "adequate") << o.named;
  EXPECT_EQ(o.named, "");
  EXPECT_LT(o.chi2_after, 1.3);
}

TEST(HiddenEffects, SaturationOfTheMainFluxIsFound) { expect_named("magnetizing_saturation", 2); }
TEST(HiddenEffects, SaturationOfTheLeakageIsFound) { expect_named("leakage_saturation", 3); }
TEST(HiddenEffects, TheDeepBarIsFound) { expect_named("rotor_skin_effect", 4); }
TEST(HiddenEffects, IronLossIsFound) { expect_named("iron_loss", 5); }

TEST(SealedData, TellNothingOfWhatIsHiddenAndAreTheSameForTheSameSeed) {
  const Sealed nothing = make_sealed(cell("nothing"), Strength::kMedium, 6, kShort);
  const Sealed hidden = make_sealed(cell("iron_loss"), Strength::kMedium, 6, kShort);
  const Sealed again = make_sealed(cell("iron_loss"), Strength::kMedium, 6, kShort);
  EXPECT_EQ(hidden.data.name, nothing.data.name);
  EXPECT_TRUE(hidden.data.notes.empty());
  ASSERT_EQ(hidden.data.records.size(), nothing.data.records.size());
  EXPECT_GE(hidden.data.records.size(), 30u);
  for (std::size_t n = 0; n < hidden.data.records.size(); ++n) {
    EXPECT_EQ(hidden.data.records[n].id, nothing.data.records[n].id);
    EXPECT_EQ(hidden.data.records[n].holdout, nothing.data.records[n].holdout);
    EXPECT_EQ(hidden.data.records[n].series.i, again.data.records[n].series.i);
  }
  EXPECT_EQ(hidden.seal.truth, std::vector<std::string>{"core_loss"});
}

TEST(SealedData, MachinesSpanHalfToFiftyKilowattsAndDiffer) {
  double least = 1e9, most = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Machine m = draw_machine(seed);
    least = std::min(least, m.power_W), most = std::max(most, m.power_W);
    EXPECT_GT(m.rotor_leakage_H, 0.0);
  }
  EXPECT_GE(least, 500.0);
  EXPECT_LT(least, 1500.0);
  EXPECT_LE(most, 50e3);
  EXPECT_GT(most, 20e3);
}

// Wilson's interval against the worked figures in Newcombe 1998, Statistics in Medicine 17: 81 of 263.
TEST(Shares, HaveWilsonsInterval) {
  Share s;
  s.add(81, 263);
  EXPECT_NEAR(s.low(), 0.2553, 1e-4);
  EXPECT_NEAR(s.high(), 0.3662, 1e-4);
  Share none;
  none.add(0, 10);
  EXPECT_DOUBLE_EQ(none.low(), 0.0);
}

}  // namespace
}  // namespace imrig::bench
