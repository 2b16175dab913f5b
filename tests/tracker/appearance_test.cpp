#include "tracker/appearance.hpp"

#include <limits>

#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"

namespace skylight {
namespace {

using testing::HasSubstr;
using testing::Throws;

Picture picture_of(cv::Mat image) {
  return {.image = std::move(image), .metres_per_pixel = 0.001, .surface_height_m = 0.1};
}

void expect_refused(Picture picture, const std::string& because) {
  try {
    const Appearance appearance("r1", std::move(picture));
    FAIL() << "not refused: " << because;
  } catch (const std::invalid_argument& e) {
    EXPECT_THAT(e.what(), HasSubstr("appearance 'r1'"));
    EXPECT_THAT(e.what(), HasSubstr(because));
  }
}

TEST(Appearance, RefusesWhatIsNoPictureNamingWhatIsWrong) {
  expect_refused(picture_of({}), "empty");
  expect_refused(picture_of(cv::Mat(100, 100, CV_8UC3, cv::Scalar(40, 90, 200))), "one colour");
  expect_refused(picture_of(cv::Mat(4, 100, CV_8UC1, cv::Scalar(0))), "allowed 8 to 8192");
  expect_refused(picture_of(cv::Mat(100, 100, CV_32FC1, cv::Scalar(0))), "8 bits");
  Picture picture = picture_of(test::corner_picture(1));
  picture.metres_per_pixel = std::numeric_limits<double>::quiet_NaN();
  expect_refused(picture, "metres_per_pixel");
  picture.metres_per_pixel = 0.001;
  picture.surface_height_m = 7.0;
  expect_refused(picture, "allowed -1 to 5");
  picture.surface_height_m = 0.1;
  picture.reference_point_m.x() = 11.0;
  expect_refused(picture, "reference_point_m.x");
}

TEST(Appearance, RefusesAPictureThatIsOfOneColourWhereItsMaskKeepsIt) {
  cv::Mat image(100, 100, CV_8UC4, cv::Scalar(50, 50, 50, 255));
  cv::rectangle(image, cv::Rect(0, 0, 40, 100), cv::Scalar(250, 0, 250, 0), cv::FILLED);
  expect_refused(picture_of(image), "one colour");
}

TEST(Appearance, KeepsColourWhereColourTellsWhatGreyDoesNot) {
  // Blue and green of the same grey level (0.114 B + 0.587 G + 0.299 R).
  const Appearance colour("c",
                          picture_of(test::patch_picture(cv::Scalar(255, 60, 60), cv::Scalar(20, 115, 40))));
  EXPECT_TRUE(colour.coloured());
  cv::Mat grey;
  cv::cvtColor(test::corner_picture(3), grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  EXPECT_FALSE(Appearance("g", picture_of(grey)).coloured());
}

TEST(Appearance, SaysHowManyTurnsOfItLookTheSame) {
  EXPECT_EQ(Appearance("corners", picture_of(test::corner_picture(5))).heading_turns(), 1);

  cv::Mat bar(120, 120, CV_8UC1, cv::Scalar(30));
  cv::rectangle(bar, cv::Rect(10, 50, 100, 20), cv::Scalar(220), cv::FILLED);
  EXPECT_EQ(Appearance("bar", picture_of(bar)).heading_turns(), 2);

  cv::Mat cross = bar.clone();
  cv::rectangle(cross, cv::Rect(50, 10, 20, 100), cv::Scalar(220), cv::FILLED);
  EXPECT_EQ(Appearance("cross", picture_of(cross)).heading_turns(), 4);

  // Two patches on a diagonal: the same shape turned by 180 degrees, told apart by their colours alone.
  const cv::Scalar blue(250, 160, 130);
  const cv::Scalar green(90, 220, 110);
  EXPECT_EQ(Appearance("two colours", picture_of(test::patch_picture(blue, green))).heading_turns(), 1);
  EXPECT_EQ(Appearance("one colour twice", picture_of(test::patch_picture(blue, blue))).heading_turns(), 2);
}

TEST(CutFromFrame, GivesTheScaleOfTheRobotsPlaneAndWhereItStands) {
  test::FlatScene scene;
  scene.pictures = {{.image = test::corner_picture(7), .pose = {0.3, -0.2, 0.4}}};
  const Frame frame = scene.render();
  const Pixel centre = scene.pixel(0.3, -0.2, 0.1);
  Pose2 pose;
  const Picture cut = cut_from_frame(
      frame, scene.camera(),
      {.box_px = {centre.x() - 25, centre.y() - 25, 50, 50}, .yaw = 0.4, .surface_height_m = 0.1}, &pose);
  EXPECT_NEAR(cut.metres_per_pixel, scene.metres_per_px(0.1), 1e-9);
  EXPECT_NEAR(pose.x, 0.3, 1e-9);
  EXPECT_NEAR(pose.y, -0.2, 1e-9);
  EXPECT_NEAR(pose.yaw, 0.4, 1e-12);
  // Upright again: the cut looks like the artwork at the frame's scale.
  cv::Mat artwork;
  const double scale = 0.001 / cut.metres_per_pixel;
  cv::resize(test::corner_picture(7), artwork, {}, scale, scale, cv::INTER_AREA);
  cv::Mat shown;
  cv::cvtColor(cut.image, shown, cv::COLOR_BGRA2BGR);
  cv::Mat match;
  cv::matchTemplate(shown, artwork(cv::Rect(8, 8, artwork.cols - 16, artwork.rows - 16)), match,
                    cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::minMaxLoc(match, nullptr, &best);
  EXPECT_GT(best, 0.9);
}

TEST(CutFromFrame, RefusesABoxThatLeavesThePictureOrIsTooSmall) {
  test::FlatScene scene;
  const Frame frame = scene.render();
  for (const cv::Rect2d box :
       {cv::Rect2d(-2, 10, 50, 50), cv::Rect2d(600, 10, 50, 50), cv::Rect2d(10, 450, 50, 50),
        cv::Rect2d(10, 10, 5, 50), cv::Rect2d(10, 10, std::nan(""), 50), cv::Rect2d(10, 10, -50, -50)}) {
    EXPECT_THAT([&] { cut_from_frame(frame, scene.camera(), {.box_px = box}); },
                Throws<std::invalid_argument>())
        << box;
  }
}

}  // namespace
}  // namespace skylight
