#include "service/calibration/tags.hpp"

#include <gmock/gmock.h>

#include "service/calibration/map_frame.hpp"
#include "tests/service/calibration/cameras.hpp"

namespace skylight::calibration {
namespace {

using testing::HasSubstr;

Eigen::Isometry3d on_floor(double x, double y, double yaw) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << x, y, 0.0;
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

TEST(FindTags, FindsEachCornerToATenthOfAPixelWhicheverWayTheTagLies) {
  const auto parameters = test::ceiling_camera();
  const sim::CameraModel truth(parameters);
  const CameraModel lens(test::intrinsics_of(parameters), Eigen::Isometry3d::Identity());
  const std::vector<Eigen::Isometry3d> places{on_floor(-2.2, -1.5, 0.2), on_floor(1.9, 1.4, 1.8),
                                              on_floor(0.1, -0.4, 3.0), on_floor(2.3, -1.3, -1.3)};
  for (const char* family : {"36h11", "25h9", "16h5"}) {
    test::BoardScene scene{.camera = parameters};
    for (std::size_t i = 0; i < places.size(); ++i)
      scene.prints.push_back(test::tag_print(static_cast<int>(i) + 3, 0.2, places[i], family));
    const auto tags = find_tags(scene.render(), tag_dictionary(family), lens);
    ASSERT_EQ(tags.size(), places.size()) << family;
    double sum = 0.0;
    for (std::size_t i = 0; i < tags.size(); ++i) {
      EXPECT_EQ(tags[i].id, static_cast<int>(i) + 3);
      const auto corners = tag_points(0.2);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto at = truth.project_map(places[i] * Eigen::Vector3d(corners[k].x(), corners[k].y(), 0.0));
        const double off = (tags[i].corners[k] - at.value()).norm();
        EXPECT_LT(off, 0.3) << family << " " << tags[i].id << " corner " << k;
        sum += off * off;
      }
    }
    EXPECT_LT(std::sqrt(sum / 16.0), 0.1) << family;
  }
}

TEST(FindTags, NamesTheFamiliesThatThereAre) {
  EXPECT_EQ(tag_dictionary("36h11"), "apriltag_36h11");
  EXPECT_EQ(tag_dictionary("4x4_50"), "4x4_50");
  EXPECT_THAT([] { tag_dictionary("49h12"); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("36h11")));
}

TEST(MapFrame, PutsOriginAndAxesWhereTheyWereAsked) {
  const FloorPlace frame = frame_of({1.0, 2.0}, {1.0, 3.5});
  EXPECT_NEAR(frame.yaw_rad, std::numbers::pi / 2, 1e-12);
  const Eigen::Isometry3d motion = new_from_old(frame);
  EXPECT_LT((motion * Eigen::Vector3d(1.0, 2.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((motion * Eigen::Vector3d(1.0, 3.0, 0.5) - Eigen::Vector3d(1.0, 0.0, 0.5)).norm(), 1e-12);
  EXPECT_THAT(
      [] {
        frame_of({1, 1}, {1, 1.001});
      },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("1 cm")));
}

TEST(MapFrame, LeavesWhatIsKnownOfTheFloorAsItWas) {
  const auto parameters = test::ceiling_camera();
  const CameraModel camera(test::intrinsics_of(parameters), parameters.map_from_camera);
  CalibrationSigmas sigmas{.focal_px = 1.0, .position_m = 0.002, .rotation_rad = 0.001};
  CameraUncertainty uncertainty = camera_uncertainty(sigmas);
  uncertainty.covariance(kCameraPosition, kCameraPosition) *= 9.0;
  const Eigen::Isometry3d motion = new_from_old({0.5, -1.0, 0.7});
  const CameraModel moved_camera(camera.intrinsics(), motion * camera.map_from_camera());
  const Eigen::Vector3d at(1.5, 0.8, 0.0);
  const Eigen::Vector3d new_at = motion * at;
  const auto before = floor_covariance(camera, uncertainty, at.head<2>(), 0.0).value();
  const auto after =
      floor_covariance(moved_camera, turned(uncertainty, motion), new_at.head<2>(), 0.0).value();
  const Eigen::Matrix3d turn = motion.linear();
  EXPECT_LT((after - turn * before * turn.transpose()).norm(), 1e-9 * before.norm() + 1e-12);
}

}  // namespace
}  // namespace skylight::calibration
