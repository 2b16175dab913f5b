// The rendered picture against geometry: where things appear, judged with OpenCV's projection.
#include "sim/render/render.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "sim/camera/noise.hpp"

namespace skylight::sim {
namespace {

/// A dark room without light effects, in which only what a test puts there is bright.
Scenario dark_room() {
  Scenario scenario;
  scenario.room.wall_height_m = 0.0;
  scenario.room.size_m = {20.0, 20.0};
  scenario.room.floor.material = FloorMaterial::plain;
  scenario.room.floor.color_rgb = {0.0, 0.0, 0.0};
  scenario.light.gradient = 0.0;
  scenario.light.contact_shadow = 0.0;
  scenario.light.lamps.clear();
  CameraSpec& camera = scenario.cameras.front();
  camera.vignetting = 0.0;
  camera.depth.enabled = true;
  // Half the default camera's size: quicker under sanitizers, and a pixel is then 11 mm wide.
  camera.width_px = 960;
  camera.height_px = 540;
  camera.fx_px = camera.fy_px = 350.0;
  return scenario;
}

const FloorTexture& black_floor() {
  static const FloorTexture floor{Texture(cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(0)), true), 1.0};
  return floor;
}

/// A robot that is nothing but its plate, black with a bright disc.
struct DiscRobot {
  static constexpr double kMetresPerPx = 0.0005;
  Eigen::Vector2d centre{-0.02, 0.05};  ///< of the disc, robot frame
  double radius = 0.045;
  RobotModel model = robot_model(RobotModelName::waffle_pi);

  std::shared_ptr<const Look> look() {
    Solid plate;
    for (const Solid& solid : model.solids) {
      if (solid.carries_picture) plate = solid;
    }
    plate.side_rgb = {0.0, 0.0, 0.0};
    model.solids = {plate};
    const int size =
        static_cast<int>(std::lround((model.plate.max.y() - model.plate.min.y()) / kMetresPerPx));
    cv::Mat picture(size, size, CV_8UC3, cv::Scalar::all(0));
    const Eigen::Vector2d middle = 0.5 * (model.plate.min + model.plate.max);
    // 1/256 px of fixed-point drawing, four times larger and averaged: the disc's edge is smooth.
    cv::Mat large;
    cv::resize(picture, large, {}, 4, 4, cv::INTER_NEAREST);
    const double column = 0.5 * (large.cols - 1) - (centre.y() - middle.y()) / kMetresPerPx * 4.0;
    const double row = 0.5 * (large.rows - 1) - (centre.x() - middle.x()) / kMetresPerPx * 4.0;
    cv::circle(large, {static_cast<int>(std::lround(column * 256)), static_cast<int>(std::lround(row * 256))},
               static_cast<int>(std::lround(radius / kMetresPerPx * 4.0 * 256)), cv::Scalar::all(200),
               cv::FILLED, cv::LINE_8, 8);
    cv::resize(large, picture, picture.size(), 0, 0, cv::INTER_AREA);
    return std::make_shared<const Look>(body_of({&model, Texture(picture, false), kMetresPerPx}));
  }

  /// Centroid of the disc's image for this pose: points of the disc projected by OpenCV, weighted with the
  /// area that their surroundings take in the picture.
  Eigen::Vector2d expected_centroid(const CameraSpec& camera, const Pose2& pose) const {
    const Eigen::Isometry3d camera_from_map = map_from_camera(camera).inverse();
    const auto pixel = [&](double x, double y) {
      const Eigen::Rotation2Dd turn(pose.yaw);
      const Eigen::Vector2d at = pose.position() + turn * (centre + Eigen::Vector2d(x, y));
      const Eigen::Vector3d p = camera_from_map * Eigen::Vector3d(at.x(), at.y(), model.plate_height_m);
      std::vector<cv::Point2d> projected;
      const cv::Matx33d k(camera.fx_px, 0, 0.5 * (camera.width_px - 1), 0, camera.fy_px,
                          0.5 * (camera.height_px - 1), 0, 0, 1);
      const std::vector<cv::Point3d> point{{p.x(), p.y(), p.z()}};
      if (camera.lens == Lens::kannala_brandt) {
        const cv::Vec4d d(camera.distortion[0], camera.distortion[1], camera.distortion[2],
                          camera.distortion[3]);
        cv::fisheye::projectPoints(point, projected, cv::Affine3d::Identity(), k, d);
      } else {
        cv::projectPoints(point, cv::Vec3d(), cv::Vec3d(), k, cv::Vec<double, 5>(camera.distortion.data()),
                          projected);
      }
      return Eigen::Vector2d(projected[0].x, projected[0].y);
    };
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weight = 0.0;
    constexpr int kHalf = 6;
    for (int i = -kHalf; i <= kHalf; ++i) {
      for (int j = -kHalf; j <= kHalf; ++j) {
        const double x = radius * i / kHalf;
        const double y = radius * j / kHalf;
        if (std::hypot(x, y) > radius) continue;
        const double h = 1e-4;
        const Eigen::Vector2d dx = pixel(x + h, y) - pixel(x - h, y);
        const Eigen::Vector2d dy = pixel(x, y + h) - pixel(x, y - h);
        const double area = std::abs(dx.x() * dy.y() - dx.y() * dy.x());
        sum += area * pixel(x, y);
        weight += area;
      }
    }
    return sum / weight;
  }
};

Eigen::Vector2d centroid(const cv::Mat& mean, const Eigen::Vector2d& near) {
  const int reach = 25;
  double sum = 0.0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int y = static_cast<int>(near.y()) - reach; y <= static_cast<int>(near.y()) + reach; ++y) {
    for (int x = static_cast<int>(near.x()) - reach; x <= static_cast<int>(near.x()) + reach; ++x) {
      if (x < 0 || y < 0 || x >= mean.cols || y >= mean.rows) continue;
      const double value = mean.at<cv::Vec3w>(y, x)[1];
      sum += value;
      moment += value * Eigen::Vector2d(x, y);
    }
  }
  return sum > 0.0 ? Eigen::Vector2d(moment / sum) : Eigen::Vector2d(-1e9, -1e9);
}

PoseAt stays(const Pose2& pose) {
  return [pose](std::size_t, double) { return pose; };
}

/// Draws bodies that move from one frame to the next.
Renderer renderer_of(const Scenario& scenario, const std::vector<std::shared_ptr<const Look>>& looks) {
  Renderer renderer(scenario, scenario.cameras.front(), black_floor());
  std::vector<SceneActor> actors;
  for (const auto& look : looks) actors.push_back({look});
  renderer.set_actors(actors, stays({}));
  return renderer;
}

double worst_error(const Scenario& scenario) {
  DiscRobot robot;
  Renderer renderer = renderer_of(scenario, {robot.look()});
  const CameraSpec& camera = scenario.cameras.front();
  double worst = 0.0;
  int i = 0;
  int judged = 0;
  for (double x = -2.7; x <= 2.7; x += 0.9) {
    for (double y = -2.31; y <= 2.31; y += 0.77) {
      const Pose2 pose{x + 0.0137 * (i % 7), y, wrap_angle(0.81 * i)};
      ++i;
      const Eigen::Vector2d expected = robot.expected_centroid(camera, pose);
      const Eigen::Vector2d margin =
          expected.cwiseMin(Eigen::Vector2d(camera.width_px, camera.height_px) - expected);
      if (margin.minCoeff() < 30.0) continue;
      ++judged;
      renderer.draw(stays(pose));
      const Eigen::Vector2d found = centroid(renderer.mean(), expected);
      worst = std::max(worst, (found - expected).norm());
    }
  }
  EXPECT_GT(judged, 30);
  return worst;
}

TEST(Renderer, PutsTheDiscOnAPlateWhereGeometrySays) {
  EXPECT_LT(worst_error(dark_room()), 0.02);  // px, over the whole picture and all yaws
}

TEST(Renderer, PutsItThereThroughATiltedCameraToo) {
  Scenario scenario = dark_room();
  scenario.cameras[0].rpy_deg = {8.0, -5.0, 33.0};
  scenario.cameras[0].position_m = {0.4, -0.3, 4.2};
  EXPECT_LT(worst_error(scenario), 0.02);
}

TEST(Renderer, PutsItThereThroughAFisheyeToo) {
  Scenario scenario = dark_room();
  scenario.cameras[0].lens = Lens::kannala_brandt;
  scenario.cameras[0].distortion = {0.02, -0.006, 0.001, -0.0002, 0.0};
  EXPECT_LT(worst_error(scenario), 0.02);
}

TEST(Renderer, CentresMotionBlurOnTheMidpointOfTheExposure) {
  const Scenario scenario = dark_room();
  DiscRobot robot;
  Renderer renderer = renderer_of(scenario, {robot.look()});
  double widest = 0.0;
  for (int i = 0; i < 24; ++i) {
    const double direction = 0.7 * i;
    const Pose2 middle{-2.0 + 0.17 * i, 1.5 - 0.11 * i, wrap_angle(0.5 * i)};
    const double blur_m = 0.03;  // 2.7 px: far more than any robot of the library makes
    const double turn = 0.05;
    renderer.draw([&](std::size_t, double since) {
      const double s = since / scenario.cameras[0].exposure_s;
      return Pose2{middle.x + blur_m * s * std::cos(direction), middle.y + blur_m * s * std::sin(direction),
                   wrap_angle(middle.yaw + turn * s)};
    });
    const Eigen::Vector2d expected = robot.expected_centroid(scenario.cameras.front(), middle);
    const Eigen::Vector2d found = centroid(renderer.mean(), expected);
    EXPECT_LT((found - expected).norm(), 0.05) << i;
    widest = std::max(widest, (found - expected).norm());
  }
  EXPECT_GT(widest, 0.0);  // (it is blurred: nothing is that exact)
}

TEST(Renderer, BlursAMovingEdgeOverItsWholePath) {
  const Scenario scenario = dark_room();
  DiscRobot robot;
  robot.radius = 0.1;
  Renderer renderer = renderer_of(scenario, {robot.look()});
  const auto grey_pixels = [&](double blur_m) {
    renderer.draw([&](std::size_t, double since) {
      return Pose2{blur_m * since / scenario.cameras[0].exposure_s, 0.0, 0.0};
    });
    int count = 0;
    for (int x = 420; x < 540; ++x) {
      const int value = renderer.mean().at<cv::Vec3w>(265, x)[1] / kGreyOne;
      if (value > 10 && value < 190) ++count;
    }
    return count;
  };
  EXPECT_LE(grey_pixels(0.0), 6);
  EXPECT_GE(grey_pixels(0.12), 14);  // 0.12 m are 10 px: twice that many pixels between dark and bright
}

TEST(Renderer, DepthOfFloorAndPlateIsTheirDistanceAlongTheAxis) {
  Scenario scenario = dark_room();
  scenario.cameras[0].rpy_deg = {6.0, 4.0, 20.0};
  const CameraSpec& spec = scenario.cameras[0];
  DiscRobot robot;
  Renderer renderer = renderer_of(scenario, {robot.look()});
  const Pose2 pose{1.0, -0.6, 0.4};
  renderer.draw(stays(pose));
  const Eigen::Isometry3d map_from_optical = map_from_camera(spec);
  const cv::Matx33d k(spec.fx_px, 0, 0.5 * (spec.width_px - 1), 0, spec.fy_px, 0.5 * (spec.height_px - 1), 0,
                      0, 1);
  int on_plate = 0;
  for (int y = 5; y < spec.height_px; y += 4) {
    for (int x = 5; x < spec.width_px; x += 4) {
      std::vector<cv::Point2d> undistorted;
      const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 1e-12);
      cv::undistortPoints(std::vector<cv::Point2d>{{1.0 * x, 1.0 * y}}, undistorted, k,
                          cv::Vec<double, 5>(spec.distortion.data()), cv::noArray(), cv::noArray(), until);
      const Eigen::Vector3d ray =
          map_from_optical.linear() * Eigen::Vector3d(undistorted[0].x, undistorted[0].y, 1.0);
      const auto depth_at = [&](double height) {
        return (height - map_from_optical.translation().z()) / ray.z();
      };
      const auto seen = static_cast<double>(renderer.metres().at<float>(y, x));
      const Eigen::Vector3d at = map_from_optical.translation() + depth_at(robot.model.plate_height_m) * ray;
      const Eigen::Vector2d local = Eigen::Rotation2Dd(-pose.yaw) * (at.head<2>() - pose.position());
      const Eigen::Vector2d inside = (local - robot.model.plate.min).cwiseMin(robot.model.plate.max - local);
      if (inside.minCoeff() > 0.001) {
        EXPECT_NEAR(seen, depth_at(robot.model.plate_height_m), 1e-5);
        ++on_plate;
      } else if (inside.minCoeff() < -0.02) {
        EXPECT_NEAR(seen, depth_at(0.0), 1e-5);
      }
    }
  }
  EXPECT_GT(on_plate, 20);
}

TEST(Renderer, TheLidarLeansAwayFromTheCamerasFootAndHidesThePictureThere) {
  Scenario scenario = dark_room();
  CameraSpec& camera = scenario.cameras.front();
  camera.width_px = 1920;
  camera.height_px = 1080;
  camera.fx_px = camera.fy_px = 700.0;
  const RobotModel& model = robot_model(RobotModelName::waffle_pi);
  const cv::Mat white(266, 266, CV_8UC3, cv::Scalar::all(220));
  Renderer renderer =
      renderer_of(scenario, {std::make_shared<const Look>(body_of({&model, Texture(white, false), 0.001}))});
  for (const double x : {-2.0, 2.0}) {
    const Pose2 pose{x, 0.0, 0.9};
    renderer.draw(stays(pose));
    const Eigen::Vector2d tower = pose.position() + Eigen::Rotation2Dd(pose.yaw) * model.lidar_m;
    const auto foot = renderer.camera().project_map({tower.x(), tower.y(), model.plate_height_m});
    ASSERT_TRUE(foot);
    // Dark pixels within the white plate are the tower's; its base has the radius of the tower.
    double outward = 0.0;
    double inward = 0.0;
    for (int px = -20; px <= 20; ++px) {
      const int column = static_cast<int>(std::lround(foot->x())) + px;
      const double grey = renderer.mean().at<cv::Vec3w>(static_cast<int>(std::lround(foot->y())), column)[1] /
                          double{kGreyOne};
      if (grey < 110.0) (px * x > 0.0 ? outward : inward) += 1.0;
    }
    const double radius_px = 0.055 * 700.0 / (4.0 - model.plate_height_m);
    EXPECT_NEAR(inward, radius_px, 1.6) << x;  // where the tower stands
    EXPECT_GT(outward, radius_px + 0.8) << x;  // where it leans over the plate
    EXPECT_LT(outward, radius_px + 5.0) << x;
  }
}

TEST(Renderer, ARobotNextToAnotherHidesItOnlyWhereItIsNearer) {
  const Scenario scenario = dark_room();
  DiscRobot bright;
  const auto disc = bright.look();
  const Solid pillar{SolidKind::box, {-0.197, -0.133, 0.0}, {0.069, 0.133, 1.0}, {}, {}, false};  // black
  const auto tall = std::make_shared<const Look>(Body{{pillar}, std::nullopt, 0.0});
  Renderer renderer = renderer_of(scenario, {disc, tall});
  const std::array<Pose2, 2> poses{Pose2{2.0, 0.0, 0.0}, Pose2{1.7, 0.0, 0.0}};
  const auto light = [&](std::size_t shown) {
    renderer.draw([&](std::size_t i, double) { return i < shown ? std::optional(poses[i]) : std::nullopt; });
    return cv::sum(renderer.mean())[1];
  };
  const double alone = light(1);
  ASSERT_GT(alone, 0.0);
  EXPECT_LT(light(2), 0.2 * alone);  // the pillar towards the camera covers the disc
  const std::array<Pose2, 2> other_way{Pose2{2.0, 0.0, 0.0}, Pose2{2.4, 0.0, 0.0}};
  renderer.draw([&](std::size_t i, double) { return other_way[i]; });
  double visible = 0.0;
  const auto near = renderer.camera().project_map({1.98, 0.05, 0.104});
  for (int dy = -8; dy <= 8; ++dy) {
    for (int dx = -8; dx <= 8; ++dx) {
      visible += renderer.mean().at<cv::Vec3w>(static_cast<int>(near->y()) + dy,
                                               static_cast<int>(near->x()) + dx)[1];
    }
  }
  EXPECT_GT(visible, 0.9 * alone);  // behind it, it covers nothing
}

TEST(Renderer, LeavesNoTraceOfWhereRobotsWere) {
  const Scenario scenario;
  DiscRobot robot;
  Renderer renderer = renderer_of(scenario, {robot.look()});
  const cv::Mat before = renderer.mean().clone();
  renderer.draw(stays({1.0, 1.0, 0.0}));
  EXPECT_GT(cv::norm(before, renderer.mean(), cv::NORM_INF), 0.0);
  renderer.draw([](std::size_t, double) { return std::nullopt; });
  EXPECT_EQ(cv::norm(before, renderer.mean(), cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace skylight::sim
