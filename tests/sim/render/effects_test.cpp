// Lamps, shutter, what hides what: the rendered picture against laws and geometry worked out here.
#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "sim/camera/noise.hpp"
#include "sim/render/render.hpp"

namespace skylight::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A plain grey floor under one lamp, seen straight from above; nothing else makes light or shade.
Scenario lamp_room() {
  Scenario scenario;
  scenario.room.wall_height_m = 0.0;
  scenario.room.size_m = {6.0, 6.0};
  scenario.room.floor.gloss = 0.0;
  scenario.light.gradient = 0.0;
  scenario.light.contact_shadow = 0.0;
  scenario.light.lamps = {{.position_m = {1.0, 0.0, 3.0}, .diameter_m = 0.3, .share = 0.5}};
  CameraSpec& camera = scenario.cameras.front();
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 300.0;
  camera.distortion = {};
  camera.vignetting = 0.0;
  camera.depth.enabled = true;
  return scenario;
}

FloorTexture plain_floor(double grey) {
  return {Texture(cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(grey)), true), 1.0};
}

Solid box(const Vector3d& min, const Vector3d& max, double grey) {
  return {SolidKind::box, min, max, {grey, grey, grey}, {grey, grey, grey}, false};
}

std::shared_ptr<const Look> look_of(const std::vector<Solid>& solids) {
  return std::make_shared<const Look>(Body{solids, std::nullopt, 0.0});
}

PoseAt stays(const Pose2& pose) {
  return [pose](std::size_t, double) { return pose; };
}

double grey_at(const Renderer& renderer, const Vector2d& pixel) {
  const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
  return static_cast<double>(renderer.mean().at<cv::Vec3w>(at)[1]) / kGreyOne;
}

double floor_grey(const Renderer& renderer, double x, double y) {
  const auto pixel = renderer.camera().project_map({x, y, 0.0});
  return pixel ? grey_at(renderer, *pixel) : -1.0;
}

TEST(RenderedLight, FallsWithTheCubeOfTheCosineAwayFromTheLamp) {
  const Scenario scenario = lamp_room();
  const Renderer renderer(scenario, scenario.cameras[0], plain_floor(100));
  for (const double away : {0.0, 0.7, 1.5}) {
    const double cosine = 3.0 / std::hypot(3.0, away);
    EXPECT_NEAR(floor_grey(renderer, 1.0 - away, 0.0), 100.0 * (0.5 + 0.5 * std::pow(cosine, 3)), 0.7)
        << away;
  }
}

TEST(RenderedShadow, LiesOnTheFarSideOfTheLampWhereSimilarTrianglesPutItAsDarkAsTheLampsShare) {
  const Scenario scenario = lamp_room();
  Renderer renderer(scenario, scenario.cameras[0], plain_floor(100));
  const Renderer empty(scenario, scenario.cameras[0], plain_floor(100));
  // A plate that hovers 0.5 m above the floor, 1 m from the point below the lamp.
  renderer.set_actors({{look_of({box({-0.3, -0.3, 0.49}, {0.3, 0.3, 0.5}, 30)})}}, stays({}));
  renderer.draw(stays({0.0, 0.0, 0.0}));
  // The shadow of a point at height h lies H / (H - h) times as far from the lamp's foot.
  const double stretch = 3.0 / (3.0 - 0.5);
  const double far_edge = 1.0 + stretch * (-0.3 - 1.0);
  const auto left = [&](double x) { return floor_grey(renderer, x, 0.0) / floor_grey(empty, x, 0.0); };
  const auto lamp_share = [](double x) {
    const double lamp = 0.5 * std::pow(3.0 / std::hypot(3.0, x - 1.0), 3);
    return lamp / (lamp + 0.5);
  };
  EXPECT_NEAR(left(far_edge), 1.0 - 0.5 * lamp_share(far_edge), 0.06);  // half of the lamp is hidden there
  EXPECT_NEAR(left(far_edge + 0.06), 1.0 - lamp_share(far_edge + 0.06), 0.02);  // umbra
  // Penumbra: the lamp's diameter times h / (H - h) wide, 0.06 m, around the edge.
  EXPECT_NEAR(left(far_edge - 0.06), 1.0, 0.01);
  EXPECT_NEAR(floor_grey(renderer, 0.75, 0.0), floor_grey(empty, 0.75, 0.0), 0.02);  // towards the lamp
  EXPECT_NEAR(floor_grey(renderer, -0.45, 1.0), floor_grey(empty, -0.45, 1.0), 0.02);
}

TEST(RenderedShadow, OfSomethingThatStandsIsTheSameAndIsNotCastTwice) {
  const Scenario scenario = lamp_room();
  const auto plate = look_of({box({-0.3, -0.3, 0.49}, {0.3, 0.3, 0.5}, 30)});
  Renderer moving(scenario, scenario.cameras[0], plain_floor(100));
  Renderer fixed(scenario, scenario.cameras[0], plain_floor(100));
  moving.set_actors({{plate}}, stays({}));
  fixed.set_actors({{plate, true}}, stays({}));
  moving.draw(stays({}));
  fixed.draw(stays({}));
  EXPECT_LE(cv::norm(moving.mean(), fixed.mean(), cv::NORM_INF), 1.0);
  // A second one in the shadow of the first takes away no light that is not there.
  fixed.set_actors({{plate, true}, {plate}}, stays({}));
  fixed.draw(stays({}));
  EXPECT_NEAR(floor_grey(fixed, -0.48, 0.0), floor_grey(moving, -0.48, 0.0), 0.02);  // in both umbras
}

TEST(RenderedGloss, ShowsTheLampWhereTheMirrorLawPutsIt) {
  Scenario scenario = lamp_room();
  scenario.room.floor.gloss = 0.1;
  const Renderer glossy(scenario, scenario.cameras[0], plain_floor(0));
  // Camera at height 4 above 0, lamp at height 3 above 1: equal angles at 4 / 7 of the way.
  cv::Mat green;
  cv::extractChannel(glossy.mean(), green, 1);
  cv::Point brightest;
  cv::minMaxLoc(green, nullptr, nullptr, nullptr, &brightest);
  const auto expected = glossy.camera().project_map({4.0 / 7.0, 0.0, 0.0});
  ASSERT_TRUE(expected);
  EXPECT_NEAR(brightest.x, expected->x(), 4.0);  // (the lamp's own falloff pulls it a little)
  EXPECT_NEAR(brightest.y, expected->y(), 1.0);
  EXPECT_GT(green.at<std::uint16_t>(brightest), 10 * kGreyOne);
  EXPECT_LT(floor_grey(glossy, -2.0, 1.0), 0.5);
}

TEST(RollingShutter, SkewsAMovingBodyByItsWayDuringTheReadout) {
  Scenario scenario = lamp_room();
  scenario.light.lamps.clear();
  CameraSpec& camera = scenario.cameras[0];
  camera.shutter = Shutter::rolling;
  camera.readout_s = 0.02;
  camera.exposure_s = 0.001;
  scenario.room.size_m = {20.0, 20.0};
  Renderer renderer(scenario, camera, plain_floor(0));
  // A white bar, 4 m along the picture's columns, that moves across them.
  renderer.set_actors({{look_of({box({-0.1, -2.0, 0.0}, {0.1, 2.0, 0.1}, 200)})}}, stays({}));
  constexpr double kSpeed = 5.0;
  renderer.draw([](std::size_t, double since) { return Pose2{kSpeed * since, 0.0, 0.0}; });
  const auto middle_of_row = [&](int y) {
    double sum = 0.0;
    double moment = 0.0;
    for (int x = 0; x < camera.width_px; ++x) {
      const double value = renderer.mean().at<cv::Vec3w>(y, x)[1];
      sum += value;
      moment += value * x;
    }
    return moment / sum;
  };
  const double px_per_m = camera.fx_px / (4.0 - 0.1);
  for (const int y : {110, 240, 370}) {
    const double time = (y - 239.5) / 479.0 * camera.readout_s;
    EXPECT_NEAR(middle_of_row(y), 319.5 + kSpeed * time * px_per_m, 0.25) << y;  // (its sides lean by less)
  }
  EXPECT_NEAR(renderer.row_offset(0), 0.0, 1e-4);
  renderer.draw(stays({0.0, 1.0, 0.0}));
  const double row = 239.5 - 1.0 * px_per_m;
  EXPECT_NEAR(renderer.row_offset(0), (row - 239.5) / 479.0 * camera.readout_s, 1e-6);
}

TEST(Occlusion, ABeamHidesWhatGeometrySaysAndTheEdgeBetweenThemIsTheMeanOfBoth) {
  Scenario scenario = lamp_room();
  scenario.light.lamps.clear();
  CameraSpec& camera = scenario.cameras[0];
  Renderer renderer(scenario, camera, plain_floor(20));
  const auto beam = look_of({box({-2.5, -0.1, 1.4}, {2.5, 0.1, 1.5}, 60)});
  const auto robot = look_of({box({-0.15, -0.15, 0.0}, {0.15, 0.15, 0.1}, 180)});
  renderer.set_actors({{beam, true}, {robot}}, [](std::size_t, double) { return Pose2{}; });
  // The beam's lower edges cast the camera's view down onto the plate's plane: +-0.1 (4 - 0.1) / (4 - 1.5).
  const double half = 0.1 * 3.9 / 2.5;
  for (const double y : {0.0, 0.12, 0.2, 0.25, 0.5}) {
    const auto pose = [&](std::size_t actor, double) { return actor == 0 ? Pose2{} : Pose2{0.3, y, 0.0}; };
    renderer.draw(pose);
    const double hidden = std::max(0.0, std::min(half, y + 0.15) - std::max(-half, y - 0.15)) / 0.3;
    EXPECT_NEAR(renderer.visible(1), 1.0 - hidden, 0.05) << y;
    if (y != 0.2) continue;
    // Across the edge every grey level lies between the beam's and the plate's: the floor shows nowhere.
    const auto edge = renderer.camera().project_map({0.3, half, 0.1});
    double darkest = 255.0;
    double between = 0.0;
    for (int d = -5; d <= 5; ++d) {
      const double grey = grey_at(renderer, *edge + Vector2d(0.0, d));
      darkest = std::min(darkest, grey);
      if (grey > 65.0 && grey < 175.0) ++between;
    }
    EXPECT_NEAR(darkest, 60.0, 0.5);
    EXPECT_LE(between, 1.0);
    EXPECT_NEAR(grey_at(renderer, *edge + Vector2d(0.0, -5.0)), 180.0, 0.5);
    EXPECT_NEAR(static_cast<double>(renderer.metres().at<float>(static_cast<int>(edge->y()) + 4,
                                                                static_cast<int>(edge->x()))),
                2.5, 1e-4);
  }
}

TEST(Occlusion, IsSharedByThePictureTheBodyAndOthersThatStandBefore) {
  Scenario scenario = lamp_room();
  scenario.light.lamps.clear();
  Renderer renderer(scenario, scenario.cameras[0], plain_floor(20));
  const auto robot = look_of({box({-0.15, -0.15, 0.0}, {0.15, 0.15, 0.1}, 180)});
  const auto tall = look_of({box({-0.15, -0.15, 0.0}, {0.15, 0.15, 1.75}, 90)});
  renderer.set_actors({{robot}, {tall}}, stays({}));
  const auto seen = [&](std::optional<Pose2> small, std::optional<Pose2> big) {
    renderer.draw([&](std::size_t actor, double) { return actor == 0 ? small : big; });
    return renderer.visible(0);
  };
  EXPECT_EQ(seen(Pose2{1.0, 0.5, 0.3}, std::nullopt), 1.0);
  EXPECT_EQ(seen(std::nullopt, std::nullopt), 0.0);
  EXPECT_EQ(seen(Pose2{1.5, 0.0, 0.0}, Pose2{1.0, 0.0, 0.0}), 0.0);  // it leans 0.85 m at the top
  EXPECT_EQ(seen(Pose2{1.0, 0.0, 0.0}, Pose2{1.5, 0.0, 0.0}), 1.0);  // behind it, it hides nothing
  // The picture's edge, 319.5 px right of its middle, is 4.16 m away at the plate's height: half is seen.
  EXPECT_NEAR(seen(Pose2{320.0 / 300.0 * 3.9, 0.0, 0.0}, std::nullopt), 0.5, 0.01);
}

TEST(RenderedDepth, OfEverythingIsTheDistanceThatOneRayFindsByItself) {
  Scenario scenario = lamp_room();
  scenario.cameras[0].rpy_deg = {6.0, -9.0, 25.0};
  scenario.room.wall_height_m = 0.4;
  Renderer renderer(scenario, scenario.cameras[0], plain_floor(100));
  const std::vector<Solid> person{{SolidKind::cylinder, {-0.1, -0.1, 1.5}, {0.1, 0.1, 1.75}, {}, {}, false},
                                  box({-0.14, -0.24, 0.0}, {0.14, 0.24, 1.5}, 50),
                                  {SolidKind::wheel, {0.2, -0.1, 0.0}, {0.6, 0.1, 0.4}, {}, {}, false}};
  renderer.set_actors({{look_of(person)}, {look_of({box({-0.2, -0.1, 1.0}, {0.2, 0.1, 1.1}, 60)}), true}},
                      stays({0.8, -0.5, 0.0}));
  const Pose2 at{-0.6, 0.4, 0.9};
  renderer.draw(stays(at));
  const Eigen::Isometry3d& map_from_camera = renderer.camera().map_from_camera();
  const Vector3d eye = map_from_camera.translation();
  // Whether a place lies in the body, asked along the ray: no formula of the renderer's.
  const auto inside = [](const Vector3d& p, const Solid& s) {
    const Vector3d middle = 0.5 * (s.min + s.max);
    const double radius = 0.5 * (s.max.x() - s.min.x());
    const bool in_box = (p.array() >= s.min.array()).all() && (p.array() <= s.max.array()).all();
    if (s.kind == SolidKind::cylinder) return in_box && (p - middle).head<2>().norm() <= radius;
    if (s.kind == SolidKind::wheel)
      return in_box && std::hypot(p.x() - middle.x(), p.z() - middle.z()) <= radius;
    return in_box;
  };
  int on_body = 0;
  for (int y = 2; y < 480; y += 7) {
    for (int x = 2; x < 640; x += 7) {
      const Vector3d ray = map_from_camera.linear() * *renderer.camera().direction(Vector2d(x, y));
      const auto seen = static_cast<double>(renderer.metres().at<float>(y, x));
      const Vector3d end = eye + seen * ray;  // brown_conrady: rays are 1 along the axis
      const Eigen::Rotation2Dd turn(-at.yaw);
      const auto in_body = [&](double t) {
        const Vector3d p = eye + t * ray;
        Vector3d local;
        local << turn * (p.head<2>() - at.position()), p.z();
        return std::any_of(person.begin(), person.end(), [&](const Solid& s) { return inside(local, s); });
      };
      bool before = false;
      for (double t = 2.0; t < seen - 2e-3; t += 0.01) before = before || in_body(t);
      EXPECT_FALSE(before) << x << " " << y;  // nothing of it is nearer
      const bool on_floor = std::abs(end.z()) < 1e-4;
      if (in_body(seen + 1e-3) && !in_body(seen - 1e-3)) ++on_body;
      const bool on_wall = std::abs(end.head<2>().cwiseAbs().maxCoeff() - 3.0) < 1e-3 ||
                           std::abs(end.head<2>().cwiseAbs().maxCoeff() - 3.08) < 1e-3;
      EXPECT_TRUE(on_floor || on_wall || in_body(seen + 1e-3) || in_body(seen + 1e-5) || end.z() > 0.39)
          << x << " " << y;
    }
  }
  EXPECT_GT(on_body, 50);
}

TEST(PassingShadow, DarkensItsBandByACosineAndGoesWithoutATrace) {
  Scenario scenario = lamp_room();
  scenario.light.lamps.clear();
  Renderer renderer(scenario, scenario.cameras[0], plain_floor(100));
  const cv::Mat before = renderer.mean().clone();
  renderer.set_passing_shadow({{.darkness = 0.6, .width_m = 2.0, .direction_rad = 0.0, .centre_m = 0.5}});
  renderer.draw(stays({}));
  for (const double x : {-0.6, -0.4, 0.0, 0.5, 1.1, 1.6}) {
    const double share = std::abs(x - 0.5);
    const double dark = share < 1.0 ? 0.6 * 0.5 * (1.0 + std::cos(std::numbers::pi * share)) : 0.0;
    EXPECT_NEAR(floor_grey(renderer, x, 0.7), 100.0 * (1.0 - dark), 0.7) << x;
  }
  renderer.set_passing_shadow({});
  renderer.draw(stays({}));
  EXPECT_EQ(cv::norm(before, renderer.mean(), cv::NORM_INF), 0.0);
}

TEST(Renderer, GivesTheSameBytesOnAnyNumberOfThreadsAndAfterTheCameraCameBack) {
  Scenario scenario = lamp_room();
  scenario.cameras[0].shutter = Shutter::rolling;
  const auto robot = std::make_shared<const Look>(
      body_of({&robot_model(RobotModelName::waffle_pi), Texture(draw_robot_picture(3, 266), false), 0.001}));
  const auto pose = [](std::size_t i, double since) {
    return Pose2{-1.0 + 0.5 * static_cast<double>(i) + 0.3 * since, 0.2,
                 0.8 * static_cast<double>(i) + since};
  };
  const int threads = cv::getNumThreads();
  const auto draw = [&](int count) {
    cv::setNumThreads(count);
    Renderer renderer(scenario, scenario.cameras[0], plain_floor(100));
    renderer.set_actors({{robot}, {robot}, {robot, true}}, pose);
    renderer.draw(pose);
    return renderer;
  };
  const Renderer one = draw(1);
  Renderer two = draw(2);
  cv::setNumThreads(threads);
  EXPECT_EQ(cv::norm(one.mean(), two.mean(), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(one.metres(), two.metres(), cv::NORM_INF), 0.0);
  Eigen::Isometry3d bumped = map_from_camera(scenario.cameras[0]);
  bumped.translation().x() += 0.05;
  two.move_camera(bumped);
  two.draw(pose);
  EXPECT_GT(cv::norm(one.mean(), two.mean(), cv::NORM_INF), 0.0);
  two.move_camera(map_from_camera(scenario.cameras[0]));
  two.draw(pose);
  EXPECT_EQ(cv::norm(one.mean(), two.mean(), cv::NORM_INF), 0.0);
}

/// A parked robot, one that drives past it and back, a third beside its way, a fourth out of reach that comes
/// and goes; each frame is 0.1 s.
std::optional<Pose2> traffic(std::size_t actor, double time_s) {
  const double way = std::abs(std::fmod(time_s, 2.0) - 1.0);  // 1 to 0 and back
  switch (actor) {
    case 0:
      return Pose2{-0.5, 0.1, 0.3};
    case 1:
      return Pose2{-1.5 + 2.0 * way, 0.5 - 0.8 * way, way};
    case 2:
      return Pose2{-0.9, 0.1, 1.3};
    default:
      if (std::fmod(time_s, 0.8) > 0.4) return std::nullopt;
      return Pose2{1.4, -0.8, 0.2};
  }
}

TEST(Renderer, FramesDoNotDependOnWhatWasDrawnBefore) {
  Scenario scenario = lamp_room();
  scenario.light.contact_shadow = 0.4;
  scenario.cameras[0].shutter = Shutter::rolling;
  scenario.cameras[0].width_px = 320;
  scenario.cameras[0].height_px = 240;
  scenario.cameras[0].fx_px = scenario.cameras[0].fy_px = 250.0;
  const auto picture = [](int number) {
    return std::make_shared<const Look>(body_of(
        {&robot_model(RobotModelName::waffle_pi), Texture(draw_robot_picture(number, 266), false), 0.001}));
  };
  std::vector<SceneActor> actors{{picture(1)}, {picture(2)}, {picture(3)}, {picture(4)}};
  Renderer one(scenario, scenario.cameras[0], plain_floor(100));
  for (int frame = 0; frame < 16; ++frame) {
    const PoseAt pose = [frame](std::size_t i, double since) { return traffic(i, 0.1 * frame + since); };
    if (frame == 0) one.set_actors(actors, pose);
    if (frame == 7) {
      actors[0].look = picture(5);
      one.set_look(0, actors[0].look);
    }
    std::vector<PassingShadow> passing;
    if (frame == 11) passing.push_back({.centre_m = -0.5});
    one.set_passing_shadow(passing);
    one.draw(pose);
    Renderer fresh(scenario, scenario.cameras[0], plain_floor(100));
    fresh.set_actors(actors, pose);
    fresh.set_passing_shadow(passing);
    fresh.draw(pose);
    ASSERT_EQ(cv::norm(one.mean(), fresh.mean(), cv::NORM_INF), 0.0) << "frame " << frame;
    ASSERT_EQ(cv::norm(one.metres(), fresh.metres(), cv::NORM_INF), 0.0) << "frame " << frame;
  }
}

TEST(Look, RefusesABodyWithoutSolidsAndAPictureWithoutAPlate) {
  EXPECT_THROW(Look(Body{}), std::invalid_argument);
  EXPECT_THROW(Look(Body{{box({0, 0, 0}, {1, 1, 1}, 9)}, Decal{}, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace skylight::sim
