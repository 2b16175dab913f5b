// A board is held before a camera, and the API tells which views are taken and what they give.
#include <gmock/gmock.h>

#include "tests/service/calibration/cameras.hpp"
#include "tests/service/calibration_room.hpp"

namespace skylight::service::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kAt = "/calibration";

/// A chessboard of 9 x 6 corners before a camera of 640 x 480 px.
class GuidedView : public testing::Test {
 protected:
  static constexpr double kSquare = 0.05;
  GuidedView() : truth_(skylight::test::small_camera()), lens_(truth_), room_({{"ceiling", believed()}}) {}

  CameraModel believed() const {
    Intrinsics roughly = skylight::test::intrinsics_of(truth_);
    roughly.fx_px = roughly.fy_px = 480.0;
    roughly.cx_px = 319.5;
    roughly.cy_px = 239.5;
    roughly.distortion = {};
    return {roughly, truth_.map_from_camera};
  }
  cv::Mat picture(const Eigen::Isometry3d& camera_from_board, double defocus_px = 0.5) {
    return skylight::test::BoardScene{.camera = truth_,
                                      .defocus_px = defocus_px,
                                      .seed = 5,
                                      .frame = ++frame_,
                                      .prints = {skylight::test::chessboard_print(
                                          9, 6, kSquare, truth_.map_from_camera * camera_from_board)}}
        .render();
  }
  Eigen::Isometry3d held(const skylight::test::HeldBoard& board) const {
    return skylight::test::camera_from_held(lens_, board);
  }
  Answer start(const std::string& board = "chessboard:9x6:0.05") {
    return room_.call("POST", "/calibration/intrinsics", {{"board", board}, {"model", "pinhole"}});
  }

  sim::CameraParameters truth_;
  sim::CameraModel lens_;
  std::uint64_t frame_ = 0;
  CalibrationRoom room_;
};

TEST_F(GuidedView, SaysOfEachFrameWhetherItIsTakenAndWhyNot) {
  ASSERT_EQ(start().status, 201);
  EXPECT_EQ(start().status, 409) << "one at a time";
  const cv::Mat empty(480, 640, CV_8UC3, cv::Scalar(110, 110, 110));
  Json told = room_.show_to_guide(empty);
  EXPECT_EQ(told["newest"]["taken"], false);
  EXPECT_THAT(told["newest"]["why_not"].get<std::string>(), HasSubstr("no chessboard of 9x6"));

  const auto middle = held({.pixel = {320, 240}, .distance_m = 0.9, .tilt_right = 0.5});
  told = room_.show_to_guide(picture(middle));
  EXPECT_EQ(told["newest"]["taken"], true) << told["newest"];
  EXPECT_EQ(told["newest"]["corners_px"].size(), 54U);
  EXPECT_EQ(told["views"].size(), 1U);
  // The corners are where they are drawn over the picture: in the middle, the first above or below it.
  EXPECT_NEAR(told["newest"]["corners_px"][22][0].get<double>(), 320.0, 40.0);
  EXPECT_GT(told["coverage"]["corners"][2][3].get<int>(), 0);
  EXPECT_EQ(told["coverage"]["corners"][0][0], 0);
  EXPECT_THAT(told["missing"].dump(), AllOf(HasSubstr("top left corner"), HasSubstr("left, right")));

  told = room_.show_to_guide(picture(middle));
  EXPECT_EQ(told["newest"]["why_not"], "much like another picture");
  told = room_.show_to_guide(picture(held({.pixel = {200, 300}, .distance_m = 0.9}), 3.0));
  EXPECT_THAT(told["newest"]["why_not"].get<std::string>(), HasSubstr("blurred"));
  room_.show_to_guide(picture(held({.pixel = {420, 200}, .distance_m = 1.0, .tilt_down = 0.5})));
  told = room_.show_to_guide(picture(held({.pixel = {300, 300}, .distance_m = 1.0, .tilt_down = -0.5})),
                             std::chrono::milliseconds(100));
  EXPECT_THAT(told["newest"]["why_not"].get<std::string>(), HasSubstr("moves"));

  const Answer early = room_.call("POST", "/calibration/intrinsics/finish");
  EXPECT_EQ(early.status, 409);
  EXPECT_THAT(early.detail(), AllOf(HasSubstr("2 views"), HasSubstr("at least 3")));
  EXPECT_EQ(room_.call("DELETE", "/calibration/intrinsics").status, 204);
  EXPECT_EQ(room_.get("/calibration/intrinsics").status, 404);
  EXPECT_EQ(room_.call("DELETE", "/calibration/intrinsics").status, 404);
  EXPECT_EQ(room_.call("POST", "/calibration/intrinsics/finish").status, 404);
}

TEST_F(GuidedView, RecognisesABoardThatIsNotAsItWasDescribed) {
  const Answer none = start("chessboard:9x6");
  EXPECT_EQ(none.status, 422);
  EXPECT_THAT(none.detail(), AllOf(HasSubstr("body: board"), HasSubstr("chessboard:9x6:0.025")));
  ASSERT_EQ(start("chessboard:8x5:0.05").status, 201);
  const cv::Mat seen = picture(held({.pixel = {320, 240}, .distance_m = 0.9, .tilt_right = 0.3}));
  Json told = room_.show_to_guide(seen);
  EXPECT_TRUE(told["suspicion"].is_null()) << "perhaps nobody holds it yet";
  for (int i = 0; i < 20 && told["suspicion"].is_null(); ++i) told = room_.show_to_guide(seen);
  EXPECT_EQ(told["newest"]["taken"], false);
  EXPECT_THAT(told["suspicion"].dump(), HasSubstr("9x6")) << told;
}

TEST_F(GuidedView, RefusesViewsThatContradictEachOtherAndGoesOnCollecting) {
  ASSERT_EQ(start().status, 201);
  const std::string before = etag(room_.get(kAt));
  for (const double x : {-0.3, 0.0, 0.3}) {  // parallel to the picture: nothing tells the focal length
    Eigen::Isometry3d flat = Eigen::Isometry3d::Identity();
    flat.translation() << x, 0.1 * x, 1.2;
    flat.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    ASSERT_EQ(room_.show_to_guide(picture(flat))["newest"]["taken"], true);
  }
  ASSERT_EQ(room_.call("POST", "/calibration/intrinsics/finish").status, 202);
  const Json told = room_.fitted();
  EXPECT_EQ(told["state"], "collecting");
  EXPECT_TRUE(told["result"].is_null());
  EXPECT_THAT(told["refusal"].dump(), HasSubstr("tilted")) << told["refusal"];
  EXPECT_EQ(etag(room_.get(kAt)), before);
}

TEST_F(GuidedView, EndsWithACalibrationThatIsInUse) {
  ASSERT_EQ(start().status, 201);
  for (const Eigen::Isometry3d& pose : skylight::test::held_boards(lens_, 12, 0.85, 3))
    room_.show_to_guide(picture(pose));
  const Json collected = room_.guided();
  EXPECT_GE(collected["views"].size(), 9U);
  ASSERT_EQ(room_.call("POST", "/calibration/intrinsics/finish").status, 202);
  const Json done = room_.fitted();
  ASSERT_EQ(done["state"], "done") << done["refusal"];
  EXPECT_LT(done["result"]["rms_px"].get<double>(), 0.2);
  EXPECT_EQ(done["result"]["views"].size(), collected["views"].size());
  EXPECT_THAT(done["result"]["warnings"].dump(), HasSubstr("extrinsics next"));
  const Json in_use = room_.get(kAt).json();
  const double sigma = in_use["sigmas"]["focal_px"][0];
  EXPECT_GT(sigma, 0.0);
  EXPECT_NEAR(in_use["intrinsics"]["fx_px"].get<double>(), truth_.fx_px, 4.0 * sigma);
  EXPECT_EQ(in_use["intrinsics_made"]["from"], "chessboard:9x6:0.05");
  EXPECT_EQ(start().status, 201) << "one that is done makes room for the next";
}

}  // namespace
}  // namespace skylight::service::test
