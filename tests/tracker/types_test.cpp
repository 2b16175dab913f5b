#include "tracker/types.hpp"

#include <numbers>
#include <set>

#include <gtest/gtest.h>

namespace skylight {
namespace {

TEST(Types, EveryPoseKindReadsBackFromItsName) {
  for (const PoseKind kind :
       {PoseKind::measured, PoseKind::filtered, PoseKind::smoothed, PoseKind::predicted}) {
    EXPECT_EQ(pose_kind_from_string(to_string(kind)), kind) << to_string(kind);
  }
  EXPECT_EQ(pose_kind_from_string("Filtered"), std::nullopt);
  EXPECT_EQ(pose_kind_from_string(""), std::nullopt);
}

TEST(Types, NamesAreThoseOfTheInterfaceAndNoTwoAreTheSame) {
  EXPECT_EQ(to_string(PoseKind::measured), "measured");
  EXPECT_EQ(to_string(PoseSource::prediction), "prediction");
  const std::set<std::string_view> states{
      to_string(TrackState::searching),  to_string(TrackState::calibrating), to_string(TrackState::tracking),
      to_string(TrackState::predicting), to_string(TrackState::occluded),    to_string(TrackState::lost)};
  EXPECT_EQ(states, (std::set<std::string_view>{"searching", "calibrating", "tracking", "predicting",
                                                "occluded", "lost"}));
  const std::set<std::string_view> sources{
      to_string(PoseSource::orb),      to_string(PoseSource::align), to_string(PoseSource::homography),
      to_string(PoseSource::apriltag), to_string(PoseSource::depth), to_string(PoseSource::prediction)};
  EXPECT_EQ(sources.size(), 6U);
}

TEST(Types, AnglesWrapIntoTheHalfOpenTurn) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_EQ(wrap_angle(kPi), kPi);
  EXPECT_EQ(wrap_angle(-kPi), kPi);
  EXPECT_NEAR(wrap_angle(3.0 * kPi), kPi, 1e-15);
  EXPECT_NEAR(wrap_angle(-kPi - 0.25), kPi - 0.25, 1e-15);
  EXPECT_NEAR(wrap_angle(7.0), 7.0 - 2.0 * kPi, 1e-15);
  EXPECT_EQ(wrap_angle(-0.5), -0.5);
}

TEST(Types, SecondsConvertToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(1.5).count(), 1'500'000'000);
  EXPECT_EQ(from_seconds(-1e-9 * 0.6).count(), -1);
  EXPECT_EQ(to_seconds(std::chrono::milliseconds(-250)), -0.25);
}

}  // namespace
}  // namespace skylight
