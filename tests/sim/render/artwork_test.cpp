// Robot pictures and tags: libapriltag's own detector reads what is printed and what a camera sees.
#include "sim/render/artwork.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "sim/camera/camera_model.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/simulation.hpp"

namespace skylight::sim {
namespace {

struct Found {
  int id = -1;
  Eigen::Vector2d centre{0.0, 0.0};  ///< px
  Eigen::Vector2d up{0.0, 0.0};      ///< px; half the upright tag's height
};

apriltag_family_t* create(const std::string& family) {
  if (family == "25h9") return tag25h9_create();
  if (family == "16h5") return tag16h5_create();
  if (family == "Standard41h12") return tagStandard41h12_create();
  return tag36h11_create();
}

void destroy(apriltag_family_t* family) {
  const std::string name = family->name;
  if (name == "tag25h9") return tag25h9_destroy(family);
  if (name == "tag16h5") return tag16h5_destroy(family);
  if (name == "tagStandard41h12") return tagStandard41h12_destroy(family);
  tag36h11_destroy(family);
}

Eigen::Vector2d place(const matd_t& h, double x, double y) {
  const auto row = [&](unsigned i) { return h.data[3 * i] * x + h.data[3 * i + 1] * y + h.data[3 * i + 2]; };
  return {row(0) / row(2), row(1) / row(2)};
}

/// The one tag of a family in a picture; id -1 where it is not one.
Found detect(const cv::Mat& bgr, const std::string& family_name) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, bgr.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(create(family_name), destroy);
  const std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector(
      apriltag_detector_create(), apriltag_detector_destroy);
  detector->nthreads = 1;
  detector->quad_decimate = 1.0F;
  apriltag_detector_add_family_bits(detector.get(), family.get(), 0);  // no bit may be wrong
  image_u8_t image{grey.cols, grey.rows, static_cast<int32_t>(grey.step), grey.data};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(apriltag_detector_detect(detector.get(), &image),
                                                             apriltag_detections_destroy);
  Found result;
  if (zarray_size(found.get()) != 1) return result;
  apriltag_detection_t* detection = nullptr;
  zarray_get(found.get(), 0, &detection);
  result.id = detection->id;
  result.centre = place(*detection->H, 0.0, 0.0) - Eigen::Vector2d(0.5, 0.5);  // its pixels begin at 0
  result.up = place(*detection->H, 0.0, -1.0) - place(*detection->H, 0.0, 0.0);
  return result;
}

/// One robot with a tag, seen from above without noise.
Scenario scenario_with(const TagSpec& tag, RobotModelName model = RobotModelName::differential) {
  Scenario scenario;
  RobotSpec robot;
  robot.id = "anna";
  robot.model = model;
  robot.picture.enabled = false;
  robot.tag = tag;
  scenario.robots = {robot};
  CameraSpec& camera = scenario.cameras.front();
  camera.width_px = 320;
  camera.height_px = 240;
  camera.position_m = {0.0, 0.0, 1.5};
  camera.fx_px = camera.fy_px = 700.0;
  camera.distortion = {};
  camera.sensor.noise = false;
  camera.exposure_s = 0.001;
  scenario.room.size_m = {2.0, 2.0};
  scenario.light.lamps.clear();
  return scenario;
}

TEST(Tags, OfEveryFamilyAreReadFromThePrint) {
  struct Case {
    const char* family;
    int last;
  };
  for (const auto& [family, last] :
       {Case{"36h11", 586}, Case{"25h9", 34}, Case{"16h5", 29}, Case{"Standard41h12", 2114}}) {
    for (const int id : {0, 7, last}) {
      const Scenario scenario = scenario_with({.family = family, .id = id, .size_m = 0.1});
      cv::Mat print = make_picture(scenario, 0).image;
      cv::Mat grey(print.size(), CV_8UC4, cv::Scalar::all(128));
      print.copyTo(grey,
                   print.reshape(1, static_cast<int>(print.total())).col(3).clone().reshape(1, print.rows));
      EXPECT_EQ(detect(grey, family).id, id) << family;
    }
  }
}

TEST(Tags, ACameraSeesThemWhereTheyAreAndAsTheyAreTurned) {
  for (const double yaw_deg : {0.0, 30.0, 90.0, -120.0}) {
    const TagSpec tag{.id = 42, .size_m = 0.08, .x_m = 0.03, .y_m = -0.02, .yaw_deg = yaw_deg};
    Scenario scenario = scenario_with(tag);
    scenario.robots[0].start = {.x_m = 0.05, .y_m = 0.02, .yaw_deg = 25.0};
    Simulation simulation(scenario);
    const auto shot = simulation.next();
    ASSERT_TRUE(shot);
    const Found found = detect(shot->frame.image, "36h11");
    ASSERT_EQ(found.id, 42) << yaw_deg;

    const double robot_yaw = 25.0 * std::numbers::pi / 180.0;
    const double up_yaw = robot_yaw + yaw_deg * std::numbers::pi / 180.0;  // upright: up is forward
    const Eigen::Vector2d middle =
        Eigen::Vector2d(0.05, 0.02) + Eigen::Rotation2Dd(robot_yaw) * Eigen::Vector2d(0.03, -0.02);
    const CameraModel camera = camera_model(scenario.cameras[0]);
    const double height = robot_model(RobotModelName::differential).plate_height_m;
    const Eigen::Vector2d expected = *camera.project_map({middle.x(), middle.y(), height});
    EXPECT_LT((found.centre - expected).norm(), 0.3) << yaw_deg;
    // The picture's right is map x, its upper side map y.
    const double seen_yaw = std::atan2(-found.up.y(), found.up.x());
    EXPECT_LT(std::abs(wrap_angle(seen_yaw - up_yaw)), 0.02) << yaw_deg;
    const double half_px = 0.04 * 700.0 / (1.5 - height);
    EXPECT_NEAR(found.up.norm() / half_px, 1.0, 0.03) << "size_m is the border's outer edge";
  }
}

TEST(Tags, LieWhereThePlateHasRoom) {
  const auto at = tag_place(scenario_with({.size_m = 0.1}), 0);
  ASSERT_TRUE(at);
  EXPECT_EQ(at->x_m, 0.0);  // nothing stands in the middle of this robot's plate
  EXPECT_EQ(at->y_m, 0.0);
  const Scenario waffle = scenario_with({.id = 5}, RobotModelName::waffle_pi);
  const auto beside = tag_place(waffle, 0);
  ASSERT_TRUE(beside);
  const RobotModel& model = robot_model(RobotModelName::waffle_pi);
  const Eigen::Vector2d lidar = model.lidar_m - 0.5 * (model.plate.min + model.plate.max);
  const Eigen::Vector2d off = (lidar - Eigen::Vector2d(beside->x_m, beside->y_m)).cwiseAbs();
  EXPECT_GE((off.array() - 0.05).matrix().cwiseMax(0.0).norm(), model.lidar_radius_m);
  EXPECT_EQ(detect(make_picture(waffle, 0).image, "36h11").id, 5);
  Simulation simulation(waffle);
  EXPECT_EQ(detect(simulation.next()->frame.image, "36h11").id, 5);
  EXPECT_FALSE(tag_place(
      [] {
        Scenario none = scenario_with({});
        none.robots[0].tag.reset();
        return none;
      }(),
      0));
}

void expect_error(const Scenario& scenario, const std::vector<std::string>& words) {
  try {
    make_picture(scenario, 0);
    ADD_FAILURE() << "no error with " << words.front();
  } catch (const std::invalid_argument& error) {
    for (const std::string& word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

TEST(Tags, ThatCannotBeAreRefusedWithWhatCan) {
  expect_error(scenario_with({.id = 587}), {"robots[0].tag.id", "587", "36h11", "0 to 586"});
  expect_error(scenario_with({.family = "16h5", .id = 30}), {"robots[0].tag.id", "0 to 29"});
  expect_error(scenario_with({.id = -1}), {"robots[0].tag.id", "0 to 586"});
  expect_error(scenario_with({.family = "99h9"}), {"robots[0].tag.family", "99h9", "36h11"});
  expect_error(scenario_with({.size_m = 0.5}), {"robots[0].tag", "0.625 m", "no room", "at most"});
  expect_error(scenario_with({.size_m = 0.1, .x_m = 0.1}), {"robots[0].tag", "sticks out"});
  expect_error(scenario_with({.x_m = 0.0}, RobotModelName::waffle_pi), {"robots[0].tag", "lidar", "0.08 m"});
}

TEST(Artwork, HasAHoleWhereTheLidarStandsAndNoneWithoutOne) {
  Scenario scenario = scenario_with({}, RobotModelName::waffle_pi);
  scenario.robots[0].tag.reset();
  scenario.robots[0].picture.enabled = true;
  const auto see_through = [&](RobotModelName model) {
    scenario.robots[0].model = model;
    const RobotPicture picture = make_picture(scenario, 0);
    cv::Mat alpha;
    cv::extractChannel(picture.image, alpha, 3);
    return static_cast<double>(cv::countNonZero(alpha == 0)) * picture.metres_per_pixel *
           picture.metres_per_pixel;
  };
  EXPECT_NEAR(see_through(RobotModelName::waffle_pi), std::numbers::pi * 0.058 * 0.058, 2e-4);
  EXPECT_EQ(see_through(RobotModelName::differential), 0.0);
  EXPECT_EQ(see_through(RobotModelName::holonomic), 0.0);
}

TEST(Artwork, OffIsABarePlate) {
  Scenario scenario = scenario_with({});
  scenario.robots[0].tag.reset();
  const RobotPicture picture = make_picture(scenario, 0);
  cv::Mat alpha;
  cv::extractChannel(picture.image, alpha, 3);
  EXPECT_EQ(cv::countNonZero(alpha), 0);
  const RobotModel& model = robot_model(RobotModelName::differential);
  const Bgr color = make_look(scenario.robots[0], picture).picture.sample(0, 20.0F, 30.0F);
  for (const Solid& solid : model.solids) {
    if (solid.carries_picture) {
      EXPECT_LT((color - bgr(solid.top_rgb)).norm(), 1e-3);
    }
  }
}

TEST(Artwork, KeepsThePictureAroundTheTag) {
  Scenario scenario = scenario_with({.id = 3, .size_m = 0.05, .x_m = -0.05, .y_m = 0.05});
  scenario.robots[0].picture.enabled = true;
  const RobotPicture with = make_picture(scenario, 0);
  const auto place = tag_place(scenario, 0);
  scenario.robots[0].tag.reset();
  const RobotPicture without = make_picture(scenario, 0);
  cv::Mat scaled;
  cv::resize(without.image, scaled, with.image.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat apart;
  cv::absdiff(with.image, scaled, apart);
  int beside = 0;
  for (int r = 0; r < apart.rows; ++r) {
    for (int c = 0; c < apart.cols; ++c) {
      const double x = (0.5 * (apart.rows - 1) - r) * with.metres_per_pixel - place->x_m;
      const double y = (0.5 * (apart.cols - 1) - c) * with.metres_per_pixel - place->y_m;
      const bool on_tag = std::max(std::abs(x), std::abs(y)) < 0.5 * place->printed_m + with.metres_per_pixel;
      const auto& pixel = apart.at<cv::Vec4b>(r, c);
      if (!on_tag) beside = std::max({beside, int{pixel[0]}, int{pixel[1]}, int{pixel[2]}});
    }
  }
  EXPECT_LE(beside, 1);
  EXPECT_EQ(detect(with.image, "36h11").id, 3);
}

TEST(Artwork, KeepsASmallPictureInTheMiddleAndAtItsSizeBesideATag) {
  Scenario scenario = scenario_with({.id = 3, .size_m = 0.03, .x_m = 0.08, .y_m = 0.08});
  scenario.robots[0].picture.enabled = true;
  scenario.robots[0].picture.width_m = 0.1;
  RobotPicture picture = make_picture(scenario, 0);
  cv::Mat alpha;
  cv::extractChannel(picture.image, alpha, 3);
  const cv::Rect middle(alpha.cols / 4, alpha.rows / 4, alpha.cols / 2, alpha.rows / 2);  // without the tag
  const cv::Rect printed = cv::boundingRect(alpha(middle)) + middle.tl();
  const double mpp = picture.metres_per_pixel;
  EXPECT_NEAR(printed.width * mpp, 0.1, 1.5 * mpp);
  EXPECT_NEAR(printed.height * mpp, 0.1, 1.5 * mpp);
  EXPECT_EQ(2 * printed.x + printed.width, alpha.cols);
  EXPECT_EQ(2 * printed.y + printed.height, alpha.rows);
}

TEST(Artwork, CoveredHidesTheTagAloneOrAll) {
  Scenario scenario = scenario_with({.id = 3, .size_m = 0.05, .x_m = -0.05, .y_m = 0.05});
  scenario.robots[0].picture.enabled = true;
  const RobotPicture open = make_picture(scenario, 0);
  const RobotPicture card = make_covered(scenario, 0, true);
  const RobotPicture cloth = make_covered(scenario, 0, false);
  ASSERT_EQ(detect(open.image, "36h11").id, 3);
  EXPECT_EQ(detect(card.image, "36h11").id, -1);
  EXPECT_EQ(detect(cloth.image, "36h11").id, -1);
  cv::Mat apart;
  cv::absdiff(open.image, card.image, apart);
  const auto changed = cv::countNonZero(apart.reshape(1) > 0);
  const double tag_share = std::pow(0.0625 / 0.212, 2);
  EXPECT_LT(changed, 1.1 * tag_share * 4.0 * static_cast<double>(open.image.total()));
  EXPECT_GT(changed, 0.3 * tag_share * 4.0 * static_cast<double>(open.image.total()));
  cv::Mat mean;
  cv::Mat spread;
  cv::meanStdDev(cloth.image, mean, spread);
  EXPECT_LT(spread.at<double>(0), 12.0);  // nothing left of the picture
  scenario.robots[0].tag.reset();
  EXPECT_EQ(cv::norm(make_covered(scenario, 0, true).image, make_picture(scenario, 0).image, cv::NORM_INF),
            0.0);
}

}  // namespace
}  // namespace skylight::sim
