// Is it at its height, is it covered, is it gone: from many looks, and at many places.
#include <numbers>

#include <gtest/gtest.h>

#include "tests/tracker/learnt_floor.hpp"
#include "tracker/depth/height_check.hpp"
#include "tracker/depth/whereabouts.hpp"

namespace skylight {
namespace {

using test::camera_of;
using test::DepthScene;
using test::erring;
using test::learnt;
using test::square;

// Looks at something `off_m` higher than the robot, each with that much noise.
struct Looks {
  FloorDepth floor;
  std::mt19937 random{7};

  HeightCheck::Answer add(HeightCheck& check, double off_m, double sigma_m) {
    std::normal_distribution<double> noise(0.0, sigma_m);
    SurfaceLook look{.cells = 36, .readings = 36};
    look.height_m = 0.12 + off_m + noise(random);
    look.sigma_m = std::hypot(sigma_m, floor.fit().uneven_m);
    return check.add(look, 0.12, floor);
  }
  /// Of the first look that is answered by more than `open`.
  std::pair<HeightCheck::Answer, int> until_clear(double off_m, double sigma_m) {
    HeightCheck check;
    for (int look = 1;; ++look) {
      const HeightCheck::Answer answer = add(check, off_m, sigma_m);
      EXPECT_EQ(check.open(), answer == HeightCheck::Answer::open);
      EXPECT_EQ(check.passed(), answer == HeightCheck::Answer::right);
      if (answer != HeightCheck::Answer::open) return {answer, look};
    }
  }
};

Looks looks_over_a_plain_floor() {
  const DepthScene scene{.width_px = 320, .height_px = 240, .focal_px = 250, .noise_m = 0.004};
  return {learnt(scene, camera_of(scene))};
}

// The tolerance is 25 mm: 30 mm, give or take 3 mm, is within it in one look of twenty.
TEST(HeightCheck, ALookAlikeALittleHigherIsNeverRight) {
  Looks looks = looks_over_a_plain_floor();
  int passed_one_look = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto [answer, look] = looks.until_clear(i % 2 == 0 ? 0.03 : -0.03, 0.003);
    EXPECT_EQ(answer, HeightCheck::Answer::wrong) << i;
    passed_one_look += look > 1 ? 1 : 0;
  }
  EXPECT_NEAR(passed_one_look, 2000 * 0.048, 30) << "the normal distribution beyond 5 mm of 3 mm";
}

TEST(HeightCheck, TheRobotIsRightAtTheFirstLookUnlessItsHeightIsSetWrongOrTheSensorIsNoisy) {
  Looks looks = looks_over_a_plain_floor();
  int right = 0;
  int at_once = 0;
  for (int i = 0; i < 500; ++i) {
    at_once += looks.until_clear(0.003, 0.003) == std::pair(HeightCheck::Answer::right, 1) ? 1 : 0;
    right += looks.until_clear(0.018, 0.003).first == HeightCheck::Answer::right ? 1 : 0;
    const auto [answer, look] = looks.until_clear(0.0, 0.012);
    right += answer == HeightCheck::Answer::right ? 1 : 0;
    EXPECT_LE(look, HeightCheck::kMostLooks);
  }
  EXPECT_EQ(at_once, 500) << "13 mm are more than four of its sigmas";
  EXPECT_GE(right, 960) << "7 mm are 2.3 sigmas: one look in a hundred is wrong by itself";
}

// A noisy sensor cannot tell 35 mm in one look of 20 mm; the mean can.
TEST(HeightCheck, AfterItsLastLookTheMeanDecides) {
  Looks looks = looks_over_a_plain_floor();
  int last = 0;
  int wrong = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto [answer, look] = looks.until_clear(0.035, 0.02);
    EXPECT_LE(look, HeightCheck::kMostLooks);
    if (look < HeightCheck::kMostLooks) continue;
    ++last;
    wrong += answer == HeightCheck::Answer::wrong ? 1 : 0;
  }
  EXPECT_GT(last, 100);
  EXPECT_GT(wrong, 0.85 * last);
}

// On a floor that stays a centimetre uneven nobody is refused for being two of them off.
TEST(HeightCheck, WhatLastsIsAllowedForAndNeverAveragedAway) {
  DepthScene scene{.width_px = 320, .height_px = 240, .focal_px = 250, .noise_m = 0.004};
  scene.error = [](double, double x, double y) {
    return 0.018 * (std::sin(8 * x + 1.0) + std::sin(8 * y + 2.0));
  };
  Looks looks{learnt(scene, camera_of(scene))};
  const double uneven = looks.floor.fit().uneven_m;
  EXPECT_NEAR(uneven, 0.014, 0.004);
  ASSERT_GT(2.7 * uneven, 0.025 + 0.002) << "more than the tolerance";
  EXPECT_GE(look_at(looks.floor, scene.render(), square(0.28, 0.0), {}).sigma_m, uneven);
  for (int i = 0; i < 100; ++i) {
    const auto [answer, look] = looks.until_clear(2.7 * uneven, 0.0005);
    EXPECT_EQ(answer, HeightCheck::Answer::right);
    EXPECT_EQ(look, 1);
    EXPECT_EQ(looks.until_clear(4.0 * uneven, 0.0005).first, HeightCheck::Answer::wrong);
  }
}

// A cell good to 6 cm is higher than its robot by the tolerance in one case of three.
TEST(SurfaceLook, NoiseAloneCoversNobody) {
  DepthScene scene{.width_px = 320, .height_px = 240, .focal_px = 250, .noise_m = 0.12};
  scene.boxes = {{.x = 0.2, .y = 0.1, .height = 0.14}};
  const FloorDepth floor = learnt(scene, camera_of(scene));
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    scene.seed = seed;
    EXPECT_FALSE(covered(look_at(floor, scene.render(), square(0.28, 0.14), {0.2, 0.1, 0.0}), {})) << seed;
  }
}

TEST(HeightCheck, OnceRightAWrongLookIsThatLooksAlone) {
  Looks looks = looks_over_a_plain_floor();
  HeightCheck check;
  EXPECT_EQ(looks.add(check, 0.0, 0.001), HeightCheck::Answer::right);
  EXPECT_EQ(looks.add(check, 0.1, 0.001), HeightCheck::Answer::wrong);
  EXPECT_TRUE(check.passed());
  EXPECT_EQ(looks.add(check, 0.023, 0.0005), HeightCheck::Answer::right) << "would be open for another";
  HeightCheck other;
  EXPECT_EQ(looks.add(other, 0.023, 0.001), HeightCheck::Answer::open);
  EXPECT_EQ(looks.add(other, 0.1, 0.001), HeightCheck::Answer::wrong);
  EXPECT_FALSE(other.passed() || other.open()) << "begins anew";
}

// A board over all of x > 0: from x = -0.05 m on it hides three tenths of a robot of 0.28 m, left of -0.08 m
// four fifths of the robot's place are seen to be floor.
TEST(Whereabouts, SharesAreThoseOfTheNormalDistribution) {
  DepthScene scene = erring();
  const FloorDepth floor = learnt(scene, camera_of(scene));
  scene.boxes = {{.x = 1.0, .y = 0.0, .length = 2.0, .width = 6.0, .height = 1.0}};
  const cv::Mat depth = scene.render();
  const auto at = [&](double x, const Eigen::Vector2d& sigmas, double turn = 0.0) {
    const Eigen::Matrix2d axes = Eigen::Rotation2Dd(turn).toRotationMatrix();
    const Eigen::Matrix2d covariance = axes * sigmas.cwiseAbs2().asDiagonal() * axes.transpose();
    return whereabouts(floor, depth, square(0.28, 0.14), {x, 0.1, 0.0}, covariance);
  };
  const auto normal = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
  for (const double x : {-0.3, -0.15, 0.0, 0.1}) {
    const Whereabouts seen = at(x, {0.15, 0.05});
    EXPECT_NEAR(seen.covered, normal((x + 0.05) / 0.15), 0.13) << x;
    EXPECT_NEAR(seen.empty, normal((-0.08 - x) / 0.15), 0.13) << x;
    EXPECT_LE(seen.covered + seen.empty, 1.0 + 1e-9);
  }
  EXPECT_TRUE(covered(at(0.3, {0.05, 0.05})));
  EXPECT_TRUE(covered(at(-0.3, {0.15, 0.05}))) << "the rest is seen to be empty";
  EXPECT_FALSE(gone(at(-0.3, {0.15, 0.05})));
  EXPECT_TRUE(gone(at(-0.3, {0.05, 0.15}))) << "it may be beside, not ahead";
  EXPECT_FALSE(covered(at(-0.3, {0.05, 0.15})));
  EXPECT_TRUE(gone(at(-0.3, {0.15, 0.05}, std::numbers::pi / 2)));
  EXPECT_FALSE(gone(at(-0.3, {0.05, 0.15}, std::numbers::pi / 4)));
  const Eigen::Matrix2d slanted{{0.05 * 0.05, 0.9 * 0.05 * 0.15}, {0.9 * 0.05 * 0.15, 0.15 * 0.15}};
  EXPECT_TRUE(gone(whereabouts(floor, depth, square(0.28, 0.14), {-0.3, 0.1, 0.0}, slanted)));
}

TEST(Whereabouts, WhereNothingIsReadItMayBeJustAsWell) {
  DepthScene scene = erring();
  const FloorDepth floor = learnt(scene, camera_of(scene));
  cv::Mat depth = scene.render();
  depth(cv::Rect(200, 0, 240, 480)).setTo(0);
  const Eigen::Matrix2d covariance = 0.01 * Eigen::Matrix2d::Identity();
  const Whereabouts hole = whereabouts(floor, depth, square(0.28, 0.14), {0.0, 0.0, 0.0}, covariance);
  EXPECT_FALSE(covered(hole) || gone(hole));
  EXPECT_LT(hole.empty, 0.01);
}

}  // namespace
}  // namespace skylight
