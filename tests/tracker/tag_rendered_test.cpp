// Tags in rendered pictures, effects on, against the exact truth: how many are found, where, and whether the
// covariance says how well that is known.
#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "tests/support/tag_room.hpp"
#include "tracker/detect/tag_pose.hpp"

namespace skylight {
namespace {

struct Score {
  int shown = 0;
  int found = 0;
  int false_ones = 0;
  int refused = 0;
  double corner_squares = 0.0;  // px^2, per axis
  double place_squares = 0.0;   // m^2
  double yaw_squares = 0.0;
  double nees = 0.0;

  double share() const { return static_cast<double>(found) / shown; }
  double corner_rms_px() const { return std::sqrt(corner_squares / (8.0 * found)); }
  double place_rms_m() const { return std::sqrt(place_squares / found); }
  double yaw_rms() const { return std::sqrt(yaw_squares / found); }
  double nees_mean() const { return nees / found; }
};

void score_tag(const test::TagRoom& room, std::size_t robot, const Pose2& truth, const FoundTag& tag,
               Score& score) {
  const TagCorners corners = room.corners(robot, truth);
  ++score.found;
  for (std::size_t k = 0; k < 4; ++k) score.corner_squares += (tag.corners_px[k] - corners[k]).squaredNorm();
  const TagAnswer answer = tag_pose(tag, room.tag(robot), room.camera());
  if (!answer.pose) {
    ++score.refused;
    return;
  }
  const Pose2& pose = answer.pose->pose;
  const Eigen::Vector3d error(pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.yaw - truth.yaw));
  score.place_squares += error.head<2>().squaredNorm();
  score.yaw_squares += error.z() * error.z();
  score.nees += error.dot(answer.pose->covariance.ldlt().solve(error));
}

// The whole picture at once, as a search looks at it.
Score score_room(const test::TagRoomSpec& spec, int frames) {
  test::TagRoom room(spec);
  const TagFinder finder({spec.family});
  Score score;
  for (int i = 0; i < frames; ++i) {
    const sim::Shot shot = room.next();
    const auto found = finder.find(shot.frame.image, {cv::Rect({}, shot.frame.image.size()), spec.edge_px});
    std::vector<bool> is_true(found.size(), false);
    for (std::size_t robot = 0; robot < room.robots(); ++robot) {
      ++score.shown;
      const TagCorners corners = room.corners(robot, shot.truth[robot].pose);
      for (std::size_t k = 0; k < found.size(); ++k) {
        if (found[k].id != room.tag(robot).id || (found[k].corners_px[0] - corners[0]).norm() > 2.0) continue;
        is_true[k] = true;
        score_tag(room, robot, shot.truth[robot].pose, found[k], score);
      }
    }
    score.false_ones += static_cast<int>(std::count(is_true.begin(), is_true.end(), false));
  }
  std::printf("%s of %g px: %d of %d found, %d false, corners %.4f px, %.4f mm, %.3f degrees, NEES %.2f\n",
              spec.family.c_str(), spec.edge_px, score.found, score.shown, score.false_ones,
              score.corner_rms_px(), 1e3 * score.place_rms_m(), 57.29578 * score.yaw_rms(),
              score.nees_mean());
  return score;
}

class RenderedTags : public testing::TestWithParam<test::TagRoomSpec> {};

TEST_P(RenderedTags, AreFoundWhereTheyAreAsWellAsTheirCovarianceSays) {
  const Score score = score_room(GetParam(), 3);
  EXPECT_GE(score.shown, 50);
  EXPECT_GE(score.share(), 0.95);
  EXPECT_EQ(score.false_ones, 0);
  EXPECT_EQ(score.refused, 0);
  EXPECT_LT(score.corner_rms_px(), 0.05);
  EXPECT_LT(score.place_rms_m(), 0.0003);
  EXPECT_LT(score.yaw_rms(), 0.002);
  EXPECT_GT(score.nees_mean(), 0.2);
  EXPECT_LT(score.nees_mean(), 4.5);
}

INSTANTIATE_TEST_SUITE_P(Sizes, RenderedTags,
                         testing::Values(test::TagRoomSpec{.edge_px = 12.0},
                                         test::TagRoomSpec{.edge_px = 16.0},
                                         test::TagRoomSpec{.edge_px = 24.0},
                                         test::TagRoomSpec{.edge_px = 48.0, .focal_px = 700.0}));
INSTANTIATE_TEST_SUITE_P(Families, RenderedTags,
                         testing::Values(test::TagRoomSpec{.family = "25h9", .edge_px = 12.0},
                                         test::TagRoomSpec{.family = "16h5", .edge_px = 12.0},
                                         test::TagRoomSpec{.family = "Standard41h12", .edge_px = 12.0}));
// A dark room, the sensor's gain turned up: full scale is 365 electrons.
INSTANTIATE_TEST_SUITE_P(Noise, RenderedTags,
                         testing::Values(test::TagRoomSpec{.edge_px = 14.0, .analogue_gain = 40.0}));

}  // namespace
}  // namespace skylight
