// A camera whose calibration is rough is calibrated over the API from beginning to end, in the full size: a
// board is held before it, then tags are laid on the floor of its room of 6 x 6 m. Judged against the camera
// that took the pictures.
#include "tests/service/calibration_room.hpp"

#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/service/calibration/cameras.hpp"

namespace skylight::service::test {
namespace {

/// As somebody writes it down from a data sheet and a tape.
CameraModel rough(const sim::CameraParameters& truth) {
  Intrinsics in = skylight::test::intrinsics_of(truth);
  in.fx_px = in.fy_px = 0.96 * truth.fx_px;
  in.cx_px = (truth.width_px - 1) / 2.0;
  in.cy_px = (truth.height_px - 1) / 2.0;
  in.distortion = {};
  Eigen::Isometry3d pose = truth.map_from_camera;
  pose.translation() += Eigen::Vector3d(0.05, -0.08, 0.1);
  return {in, pose};
}

/// Root mean square over the floor of the room of where the camera in use has it, m.
double floor_rms_m(const CalibrationRoom& room, const sim::CameraParameters& parameters) {
  const sim::CameraModel truth(parameters);
  const auto snapshot = room.pipeline->snapshot();
  double sum = 0.0;
  int count = 0;
  for (double x = -3.0; x <= 3.0; x += 0.25) {
    for (double y = -3.0; y <= 3.0; y += 0.25, ++count) {
      const Pixel seen = truth.project_map({x, y, 0.0}).value();
      const auto at = snapshot->cameras[0].model->plane_from_pixel(seen, 0.0);
      sum += (at.value() - Eigen::Vector2d(x, y)).squaredNorm();
    }
  }
  return std::sqrt(sum / count);
}

/// Tags of 20 cm over the whole room, and how their places are told.
struct LaidTags {
  std::vector<skylight::test::Print> prints;
  Json told = Json::array();
};

LaidTags laid_tags() {
  LaidTags out;
  skylight::test::Dice dice(901);
  for (const double x : {-2.4, -0.8, 0.8, 2.4}) {
    for (const double y : {-2.4, 0.0, 2.4}) {
      const Eigen::Vector2d at(x + dice.uniform(-0.2, 0.2), y + dice.uniform(-0.2, 0.2));
      const double yaw = dice.uniform(-3.0, 3.0);
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation() << at.x(), at.y(), 0.0;
      pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      const int id = static_cast<int>(out.prints.size());
      out.prints.push_back(skylight::test::tag_print(id, 0.2, pose));
      out.told.push_back({{"id", id},
                          {"x_m", at.x()},
                          {"y_m", at.y()},
                          {"yaw_deg", yaw * 180.0 / std::numbers::pi},
                          {"size_m", 0.2}});
    }
  }
  return out;
}

TEST(CalibrationRoom, IsGuidedFromARoughCameraToOneThatKnowsTheWholeFloor) {
  const auto truth = skylight::test::ceiling_camera();
  CalibrationRoom room({{"ceiling", rough(truth)}});
  EXPECT_GT(floor_rms_m(room, truth), 0.05) << "before";

  ASSERT_EQ(room.call("POST", "/calibration/intrinsics", {{"board", "chessboard:9x6:0.06"}}).status, 201);
  std::uint64_t frame = 0;
  for (const Eigen::Isometry3d& pose : skylight::test::held_boards(sim::CameraModel(truth), 16, 0.95, 1)) {
    room.show_to_guide(skylight::test::BoardScene{
        .camera = truth,
        .motion_px = 0.8,
        .seed = 1,
        .frame = ++frame,
        .prints = {skylight::test::chessboard_print(9, 6, 0.06, truth.map_from_camera * pose)}}
                           .render());
  }
  EXPECT_GE(room.guided()["views"].size(), 12U);
  ASSERT_EQ(room.call("POST", "/calibration/intrinsics/finish").status, 202);
  const Json lens = room.fitted();
  ASSERT_EQ(lens["state"], "done") << lens["refusal"];
  EXPECT_LE(lens["result"]["rms_px"].get<double>(), 0.2);

  const LaidTags tags = laid_tags();
  room.show(skylight::test::BoardScene{.camera = truth, .seed = 501, .prints = tags.prints}.render());
  const Answer hung =
      room.call("POST", "/calibration/extrinsics", {{"tags", tags.told}, {"place_sigma_m", 0.0}});
  ASSERT_EQ(hung.status, 200) << hung.body;
  const Json fit = hung.json()["cameras"][0]["fit"];
  EXPECT_LE(fit["rms_px"].get<double>(), 0.2);
  const double rms_m = floor_rms_m(room, truth);
  EXPECT_LE(rms_m, 0.0015);
  std::printf("%zu views, %.3f px RMS; %zu corners of tags, %.3f px RMS; floor of 6 x 6 m %.2f mm RMS\n",
              lens["views"].size(), lens["result"]["rms_px"].get<double>(), fit["points"].size(),
              fit["rms_px"].get<double>(), 1e3 * rms_m);

  // The same tags once more begin from the lens as the board gave it: nothing counts twice.
  const Json again =
      room.call("POST", "/calibration/extrinsics", {{"tags", tags.told}, {"place_sigma_m", 0.0}}).json();
  EXPECT_LT(again["cameras"][0]["change"]["floor_mm"].get<double>(), 0.01);

  ASSERT_EQ(room.call("POST", "/calibration/restore", {{"version", 1}}).status, 200);
  EXPECT_GT(floor_rms_m(room, truth), 0.05) << "the camera that it began with";
}

}  // namespace
}  // namespace skylight::service::test
