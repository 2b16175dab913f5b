#include "tracker/tracker.hpp"

#include <thread>

#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"
#include "tracker/heading.hpp"
#include "tracker/search.hpp"

namespace skylight {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Time at_frame(int frame) {
  return Time{} + from_seconds(1000.0 + frame / 30.0);
}

// Two robots on a textured floor; the first drives an arc of 0.3 m/s, the second stands.
test::FlatScene room(int frame) {
  test::FlatScene scene;
  scene.floor_speckle = 1500;
  scene.seed = 5;
  const double s = 0.01 * frame;
  scene.pictures = {{.image = test::corner_picture(51),
                     .pose = {-0.5 + 0.5 * std::sin(s), 0.5 * (1 - std::cos(s)) - 0.3, wrap_angle(s)}},
                    {.image = test::corner_picture(52), .pose = {0.7, 0.5, -2.0}}};
  return scene;
}

Tracker tracker_for(const test::FlatScene& scene, bool initial_poses, Executor executor = run_in_order,
                    const FilterSpec& filter = {}) {
  Tracker tracker({scene.camera()}, {}, std::move(executor));
  for (std::size_t i = 0; i < scene.pictures.size(); ++i) {
    RobotSpec robot{.id = i == 0 ? "mover" : "stander", .appearance = test::appearance_of(scene.pictures[i])};
    robot.filter = filter;
    if (initial_poses) robot.initial_pose = scene.pictures[i].pose;
    tracker.add(robot);
  }
  return tracker;
}

TEST(Tracker, FollowsEachRobotFromItsInitialPose) {
  Tracker tracker = tracker_for(room(0), true);
  for (int i = 0; i < 40; ++i) {
    const test::FlatScene scene = room(i);
    const auto reports = tracker.process(scene.render(at_frame(i)));
    ASSERT_EQ(reports.size(), 2U);
    for (std::size_t r = 0; r < 2; ++r) {
      ASSERT_TRUE(reports[r].measured) << "frame " << i << ", " << reports[r].id << ": " << reports[r].reason;
      EXPECT_LT((reports[r].measured->pose.position() - scene.pictures[r].pose.position()).norm(), 0.0005);
      EXPECT_NEAR(wrap_angle(reports[r].measured->pose.yaw - scene.pictures[r].pose.yaw), 0.0, 0.3 * kDegree);
    }
  }
  for (const RobotView& view : tracker.views()) {
    EXPECT_EQ(view.state, TrackState::tracking);
    EXPECT_EQ(view.history.size(), 40U);
  }
}

TEST(Tracker, FindsRobotsAnywhereOnTheFloorATileAtATime) {
  Tracker tracker = tracker_for(room(0), false);
  const Frame frame = room(0).render();
  std::vector<int> found(2, -1);
  for (int i = 0; i < 40; ++i) {
    Frame now = frame;
    now.captured = at_frame(i);
    const auto reports = tracker.process(now);
    for (std::size_t r = 0; r < 2; ++r) {
      if (reports[r].measured && found[r] < 0) {
        found[r] = i;
        EXPECT_EQ(reports[r].measured->source, PoseSource::orb);
      }
    }
  }
  // 640 x 480 in tiles of 256 px that overlap by a robot: 4 x 3, shared by two robots.
  EXPECT_GE(found[0], 0);
  EXPECT_GE(found[1], 0);
  EXPECT_LE(std::max(found[0], found[1]), 24);
}

TEST(Tracker, PredictsACoveredRobotThenSaysLostThenFindsItAgain) {
  const WindowFilterConfig filter{.window_size = 5, .frame_loss_threshold = 10};
  Tracker tracker = tracker_for(room(0), true, run_in_order, filter);
  std::vector<TrackState> states;
  for (int i = 0; i < 70; ++i) {
    test::FlatScene scene = room(20);  // standing
    if (i >= 20 && i < 40) {
      const Pixel at = scene.pixel(scene.pictures[0].pose.x, scene.pictures[0].pose.y, 0.1);
      scene.covers_px = {cv::Rect(static_cast<int>(at.x()) - 40, static_cast<int>(at.y()) - 40, 80, 80)};
    }
    const auto reports = tracker.process(scene.render(at_frame(i)));
    states.push_back(reports[0].state);
    if (i >= 20 && i < 40) {
      EXPECT_FALSE(reports[0].measured) << i;
      EXPECT_FALSE(reports[0].reason.empty());
    }
    EXPECT_TRUE(reports[1].measured) << "the other robot carries on, frame " << i;
  }
  EXPECT_EQ(states[19], TrackState::tracking);
  EXPECT_EQ(states[25], TrackState::predicting);
  EXPECT_EQ(states[35], TrackState::lost);
  EXPECT_EQ(states[69], TrackState::tracking);
}

TEST(Tracker, GivesOnePlaceToOneRobot) {
  // Two robots of one appearance, one picture on the floor: only one of them may claim it.
  test::FlatScene scene = room(0);
  scene.pictures.pop_back();
  const auto appearance = test::appearance_of(scene.pictures[0]);
  Tracker tracker({scene.camera()});
  tracker.add({.id = "a", .appearance = appearance, .initial_pose = scene.pictures[0].pose});
  tracker.add({.id = "b", .appearance = appearance});
  for (int i = 0; i < 30; ++i) {
    const auto reports = tracker.process(scene.render(at_frame(i)));
    EXPECT_TRUE(reports[0].measured) << i;
    EXPECT_FALSE(reports[1].measured) << i;
  }
}

TEST(Tracker, GivesTheSameAnswersWhateverTheExecutor) {
  const Executor threads = [](std::size_t count, const std::function<void(std::size_t)>& task) {
    std::vector<std::thread> pool;
    for (std::size_t i = 0; i < count; ++i) pool.emplace_back([&, i] { task(count - 1 - i); });
    for (std::thread& thread : pool) thread.join();
  };
  Tracker one = tracker_for(room(0), true);
  Tracker many = tracker_for(room(0), true, threads);
  for (int i = 0; i < 5; ++i) {
    const Frame frame = room(i).render(at_frame(i));
    const auto a = one.process(frame);
    const auto b = many.process(frame);
    for (std::size_t r = 0; r < 2; ++r) {
      ASSERT_TRUE(a[r].measured && b[r].measured);
      EXPECT_EQ(a[r].measured->pose, b[r].measured->pose);
      EXPECT_EQ(a[r].measured->covariance, b[r].measured->covariance);
    }
  }
}

TEST(Tracker, RefusesAFrameThatDoesNotFitItsCameraAndGoesOn) {
  Tracker tracker = tracker_for(room(0), true);
  const Frame good = room(0).render(at_frame(0));
  std::vector<Frame> bad(5, good);
  bad[0].camera = 1;
  bad[1].image = cv::Mat();
  bad[2].image = cv::Mat(480, 600, CV_8UC3, cv::Scalar(0));
  bad[3].image = cv::Mat(480, 640, CV_32FC1, cv::Scalar(0));
  bad[4].depth = cv::Mat(480, 640, CV_8UC1, cv::Scalar(0));
  for (const Frame& frame : bad) EXPECT_THROW(tracker.process(frame), std::invalid_argument);
  EXPECT_TRUE(tracker.process(good)[0].measured);
}

TEST(Tracker, RefusesRobotsThatItCannotTrackNamingThem) {
  Tracker tracker = tracker_for(room(0), true);
  const auto appearance = test::appearance_of(room(0).pictures[0]);
  const auto refused = [&](RobotSpec robot) {
    try {
      tracker.add(robot);
      return std::string("accepted");
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
  };
  EXPECT_THAT(refused({.id = "", .appearance = appearance}), testing::HasSubstr("needs an id"));
  EXPECT_THAT(refused({.id = "mover", .appearance = appearance}),
              testing::HasSubstr("'mover' is there already"));
  EXPECT_THAT(refused({.id = "x"}), testing::HasSubstr("'x': it has no appearance"));
  EXPECT_THAT(refused({.id = "x", .appearance = appearance, .surface_height_m = 9.0}),
              testing::HasSubstr("allowed -1 to 5"));
  EXPECT_THAT(refused({.id = "x", .appearance = appearance, .initial_pose = Pose2{std::nan(""), 0, 0}}),
              testing::HasSubstr("not finite"));
  RobotSpec robot{.id = "x", .appearance = appearance};
  robot.filter = WindowFilterConfig{.window_size = 1};
  EXPECT_THAT(refused(robot), testing::HasSubstr("window_size"));
  robot.filter = MotionFilterConfig{.gate = 0.0};
  EXPECT_THAT(refused(robot), testing::HasSubstr("gate"));
}

TEST(Tracker, ChangesAndRemovesARobotWhileTheOthersCarryOn) {
  Tracker tracker = tracker_for(room(0), true);
  for (int i = 0; i < 3; ++i) tracker.process(room(i).render(at_frame(i)));
  RobotSpec changed = tracker.robots()[0];
  const FilterSpec filter = WindowFilterConfig{.alpha = 0.1};
  changed.filter = filter;
  EXPECT_TRUE(tracker.change(changed));
  EXPECT_EQ(tracker.robots()[0].filter, filter);
  EXPECT_EQ(tracker.views()[0].history.size(), 3U) << "what was recorded stays";
  EXPECT_TRUE(tracker.process(room(3).render(at_frame(3)))[0].measured)
      << "and it is still known where it is";
  changed.id = "nobody";
  EXPECT_FALSE(tracker.change(changed));
  EXPECT_FALSE(tracker.remove("nobody"));
  EXPECT_TRUE(tracker.remove("mover"));
  const auto reports = tracker.process(room(4).render(at_frame(4)));
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].id, "stander");
  EXPECT_TRUE(reports[0].measured);
}

TEST(Tracker, AChangeThatLeavesTheFilterAloneDoesNotInterruptTheTrack) {
  Tracker tracker = tracker_for(room(0), true, run_in_order,
                                WindowFilterConfig{.window_size = 4, .calibration_threshold = 0});
  for (int i = 0; i < 6; ++i) tracker.process(room(i).render(at_frame(i)));
  ASSERT_EQ(tracker.views()[0].state, TrackState::tracking);
  RobotSpec changed = tracker.robots()[0];
  changed.surface_height_m = 0.1;
  ASSERT_TRUE(tracker.change(changed));
  EXPECT_EQ(tracker.views()[0].state, TrackState::tracking) << "between frames too";
  EXPECT_EQ(tracker.process(room(6).render(at_frame(6)))[0].state, TrackState::tracking);
  changed.filter = WindowFilterConfig{.window_size = 6};
  ASSERT_TRUE(tracker.change(changed));
  EXPECT_NE(tracker.process(room(7).render(at_frame(7)))[0].state, TrackState::tracking);
}

TEST(HeadingResolver, KeepsTheTurnThatTheRobotDrivesTowards) {
  HeadingResolver resolver(2, {0.05, 0.0});  // the picture's centre lies 50 mm ahead of base_link
  Observation observation{.pose = {0, 0, std::numbers::pi}};
  resolver.apply(observation, std::nullopt);
  EXPECT_EQ(observation.heading_turns, 2);
  // The centre, at (-0.05, 0), goes to (0.15, 0): along +x, so yaw is 0 and base_link at 0.10.
  observation.pose = {0.20, 0, std::numbers::pi};
  resolver.apply(observation, std::nullopt);
  EXPECT_EQ(observation.heading_turns, 1);
  EXPECT_NEAR(observation.pose.yaw, 0.0, 1e-12);
  EXPECT_NEAR(observation.pose.x, 0.10, 1e-12);
  // From then on the detector's own turn does not matter.
  Observation again{.pose = {0.22, 0, std::numbers::pi}};
  resolver.apply(again, observation.pose);
  EXPECT_NEAR(again.pose.yaw, 0.0, 1e-12);
  EXPECT_EQ(again.heading_turns, 1);
}

TEST(Sweep, ShowsEveryPlaceWithARobotsWidthOfOverlap) {
  const cv::Size size(640, 480);
  constexpr int kOverlap = 60;
  Sweep sweep;
  std::vector<cv::Rect> tiles;
  for (int i = 0; i < 9; ++i) tiles.push_back(sweep.next(size, 256, kOverlap));
  for (int x = 0; x + kOverlap <= size.width; x += 7) {
    for (int y = 0; y + kOverlap <= size.height; y += 7) {
      const cv::Rect robot(x, y, kOverlap, kOverlap);
      EXPECT_TRUE(std::any_of(tiles.begin(), tiles.end(), [&](const cv::Rect& tile) {
        return (tile & robot) == robot;
      })) << robot;
    }
  }
  EXPECT_EQ(sweep.next(size, 256, kOverlap), tiles[0]) << "then it begins again";
}

}  // namespace
}  // namespace skylight
