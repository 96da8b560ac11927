// When an amplitude may as well be neutral: asked with its own shapes as they are.

#include "estimators/diagnose/missing/neutral_amplitude.h"

#include <gtest/gtest.h>

#include "estimators/model/effects/registry.h"

namespace imrig::est {
namespace {

// Amplitude and exponent of main-flux saturation, with sigmas and a correlation.
struct Two {
  WorkingModel model;
  Candidate candidate{*effect_number("magnetizing_saturation"), 0};

  Two(double extra, double sigma_extra, double sigma_exponent, double correlation) {
    const auto shared = shared_entries(candidate);
    model.active = {candidate};
    model.fit.free.shared = {shared[0], shared[1]};
    model.fit.on_bound = {false, false};
    model.fit.covariance = Eigen::MatrixXd(2, 2);
    const double both = correlation * sigma_extra * sigma_exponent;
    model.fit.covariance << sigma_extra * sigma_extra, both, both, sigma_exponent * sigma_exponent;
    model.at.shared[shared[0]] = extra;
    model.fit.at = model.at;
  }
};

TEST(NeutralAmplitude, IsNotOneThatTradesPlacesWithItsExponent) {
  EXPECT_FALSE(may_be_neutral(Two(6.0, 5.0, 2.0, 0.98).model, Two(6.0, 5.0, 2.0, 0.98).candidate));
  EXPECT_TRUE(may_be_neutral(Two(6.0, 5.0, 2.0, 0.1).model, Two(6.0, 5.0, 2.0, 0.1).candidate));
}

TEST(NeutralAmplitude, IsAskedOfTheAmplitudeAloneWhereNoShapeIsKnown) {
  const Two unsure(1.0, 0.6, 0.0, 0.0), sure(1.0, 0.4, 0.0, 0.0);
  EXPECT_TRUE(may_be_neutral(unsure.model, unsure.candidate));
  EXPECT_FALSE(may_be_neutral(sure.model, sure.candidate));
}

TEST(NeutralAmplitude, OnItsNeutralBoundIsNeutral) {
  Two two(0.0, 0.0, 0.0, 0.0);
  two.model.fit.on_bound = {true, true};
  EXPECT_TRUE(may_be_neutral(two.model, two.candidate));
}

TEST(NeutralAmplitude, IsNothingThatAFormWithoutAmplitudesHas) {
  const Two two(1.0, 0.6, 0.1, 0.0);
  EXPECT_FALSE(may_be_neutral(two.model, {*effect_number("broken_bar"), 0}));
}

}  // namespace
}  // namespace imrig::est
