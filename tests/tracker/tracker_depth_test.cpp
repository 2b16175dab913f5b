// The tracker on frames with depth: covered is not lost, look-alikes at another height are refused, searches
// look at things of the robot's height first; and frames without depth are as ever.
#include <gmock/gmock.h>

#include "tests/tracker/depth_room.hpp"

namespace skylight {
namespace {

using testing::HasSubstr;

using test::at_frame;
using test::kHeight;
using test::quick;
using test::Room;

TEST(TrackerDepth, ARobotUnderSomethingHigherIsOccludedNotLost) {
  const Room room({0.3, 0.2, 0.0});
  const Room hidden = room.covered();
  for (const bool with_depth : {true, false}) {
    Tracker tracker({room.picture.camera()});
    tracker.add(room.robot());
    const Frame seen = room.frame(0, with_depth);
    const Frame unseen = hidden.frame(1, with_depth);
    const auto show = [&](Frame frame, int at) {
      frame.captured = at_frame(at);
      return tracker.process(frame).at(0);
    };
    for (int i = 0; i < 12; ++i) EXPECT_TRUE(show(seen, i).measured) << i;
    const RobotReport first = show(unseen, 12);
    EXPECT_FALSE(first.measured);
    EXPECT_EQ(first.state, with_depth ? TrackState::occluded : TrackState::predicting);
    ASSERT_TRUE(first.filtered) << "where it is thought to be is still said";
    EXPECT_LT((first.filtered->pose.position() - Eigen::Vector2d(0.3, 0.2)).norm(), 0.01);
    RobotReport last = first;
    for (int i = 13; i < 200; i += 6) last = show(unseen, i);  // beyond the filter's 5 s
    EXPECT_EQ(last.state, with_depth ? TrackState::occluded : TrackState::lost);
    EXPECT_FALSE(last.filtered);
    if (with_depth) {
      EXPECT_THAT(std::string(last.reason), HasSubstr("covered"));
    }
    EXPECT_EQ(tracker.views().at(0).history.newest().state, last.state);
    for (int i = 200; i < 204; ++i) last = show(seen, i);
    EXPECT_EQ(last.state, TrackState::tracking) << with_depth;
  }
}

TEST(TrackerDepth, WhoWasTakenAwayFromBeneathIsNotOccludedAnyMore) {
  const Room room({0.3, 0.2, 0.0});
  Room gone = room;
  gone.picture.pictures.clear();
  gone.depth.boxes.clear();
  Tracker tracker({room.picture.camera()});
  tracker.add(room.robot());
  for (int i = 0; i < 8; ++i) tracker.process(room.frame(i));
  for (int i = 8; i < 11; ++i) tracker.process(room.covered().frame(i));
  EXPECT_EQ(tracker.views().at(0).state, TrackState::occluded);
  const RobotReport after = tracker.process(gone.frame(11)).at(0);
  EXPECT_EQ(after.state, TrackState::predicting);
  EXPECT_THAT(std::string(after.reason), HasSubstr("search"));
  for (int i = 12; i < 15; ++i) tracker.process(room.frame(i));
  EXPECT_EQ(tracker.views().at(0).state, TrackState::tracking) << "it is back";
  tracker.process(room.covered().frame(15));
  EXPECT_EQ(tracker.views().at(0).state, TrackState::occluded) << "and covered once more";
}

// A board of 0.2 m, 1 m up, over the map's middle, where the robot stops unseen: its filter drives on, out
// from under the board. The floor that is seen there says that it is not.
TEST(TrackerDepth, ARobotThatStopsUnderSomethingNarrowStaysOccluded) {
  Room room({-0.42, 0.0, 0.0});
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(room.robot());
  int at = 0;
  for (; at < 28; at += 2) {
    room.picture.pictures[0].pose.x = room.depth.boxes[0].x = -0.42 + 0.25 * at / 30.0;
    EXPECT_TRUE(tracker.process(room.frame(at)).at(0).measured) << at;
  }
  room.picture.pictures.clear();  // under the board from here on
  room.depth.boxes = {{.x = 0.0, .y = 0.0, .length = 0.2, .width = 1.0, .height = 1.0}};
  const Pixel corner = room.picture.pixel(-0.1, 0.5, 1.0);
  room.picture.covers_px = {{static_cast<int>(corner.x()), static_cast<int>(corner.y()), 50, 250}};
  Frame hidden = room.frame(at);
  bool drove_on = false;
  for (; at < 240; at += 9) {  // beyond the filter's 5 s
    hidden.captured = at_frame(at);
    const RobotReport report = tracker.process(hidden).at(0);
    EXPECT_EQ(report.state, TrackState::occluded) << at;
    drove_on = drove_on || (report.filtered && report.filtered->pose.x > 0.3);
  }
  EXPECT_TRUE(drove_on);
}

// It is taken away in the open; a second later it might have driven under the board beside it, had it gone.
TEST(TrackerDepth, WhoVanishedInTheOpenIsNotSaidToBeUnderSomethingElse) {
  Room room({-0.55, 0.0, 0.0});
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(room.robot());
  const test::DepthBox board{.x = 0.0, .y = 0.0, .length = 0.5, .width = 0.5, .height = 1.0};
  room.depth.boxes.push_back(board);
  int at = 0;
  Frame frame = room.frame(at);
  for (; at < 12; ++at) {
    frame.captured = at_frame(at);
    tracker.process(frame);
  }
  EXPECT_EQ(tracker.views().at(0).state, TrackState::tracking);
  room.picture.pictures.clear();
  room.depth.boxes = {board};
  frame = room.frame(at);
  for (; at < 200; at += 9) {
    frame.captured = at_frame(at);
    EXPECT_NE(tracker.process(frame).at(0).state, TrackState::occluded) << at;
  }
  EXPECT_EQ(tracker.views().at(0).state, TrackState::lost);
}

// A print that looks as large as the robot's picture, on a box of 0.3 m.
TEST(TrackerDepth, ALookAlikeOnABoxIsRefusedWithAReason) {
  const Room real({0.3, 0.2, 0.4});
  Room box = real;
  box.picture.pictures[0].height_m = 0.3;
  box.picture.pictures[0].metres_per_pixel *= (3.0 - 0.3) / (3.0 - kHeight);
  box.depth.boxes[0].height = 0.3;
  Tracker tracker({real.picture.camera()}, quick());
  Tracker blind({real.picture.camera()}, quick());
  tracker.add(real.robot());
  blind.add(real.robot());
  for (int i = 0; i < 3; ++i) {
    const RobotReport report = tracker.process(box.frame(i)).at(0);
    EXPECT_FALSE(report.measured);
    EXPECT_THAT(std::string(report.reason), testing::AnyOf(HasSubstr("height"), HasSubstr("higher")));
    EXPECT_TRUE(blind.process(box.frame(i, false)).at(0).measured) << "it does look like the robot";
  }
  EXPECT_TRUE(tracker.process(real.frame(3)).at(0).measured);
}

// 25.2 mm higher, of which the tolerance is 25 and the noise of a look half a millimetre: in every third
// frame it is within. The robot is under a board all the while.
TEST(TrackerDepth, ALookAlikeALittleHigherIsNotTakenForARobotThatIsCovered) {
  const Room real({-0.6, 0.4, 0.0});
  const Room look_alike({0.7, -0.4, 0.9});
  Room hidden = real.covered();
  hidden.picture.pictures = {look_alike.picture.pictures[0]};
  hidden.picture.pictures[0].height_m = kHeight + 0.0252;
  hidden.depth.boxes.push_back(look_alike.depth.boxes[0]);
  hidden.depth.boxes.back().height = kHeight + 0.0252;
  Tracker tracker({real.picture.camera()}, quick());
  tracker.add(real.robot());
  const auto show = [&](Frame frame, int at) {
    frame.captured = at_frame(at);
    return tracker.process(frame).at(0);
  };
  const Frame seen = real.frame(0);
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(show(seen, i).measured) << i;
  Frame unseen = hidden.frame(1);
  int at = 12;
  for (int i = 0; i < 12; ++i, at += 9) {  // within the 5 s that the filter carries on
    hidden.depth.seed = static_cast<std::uint32_t>(i + 1);
    unseen.depth = hidden.depth.render();
    const RobotReport report = show(unseen, at);
    EXPECT_FALSE(report.measured) << i;
    EXPECT_EQ(report.state, TrackState::occluded) << i;
    ASSERT_TRUE(report.filtered) << i;
    EXPECT_LT((report.filtered->pose.position() - Eigen::Vector2d(-0.6, 0.4)).norm(), 0.02) << i;
  }
  Room both = hidden;  // the board is gone, the look-alike still there
  both.picture.pictures.push_back(real.picture.pictures[0]);
  both.picture.covers_px.clear();
  both.depth.boxes = {real.depth.boxes[0], hidden.depth.boxes.back()};
  Frame back = both.frame(2);
  bool found = false;
  for (int i = 0; i < 8 && !found; ++i, ++at) {
    both.depth.seed = static_cast<std::uint32_t>(100 + i);
    back.depth = both.depth.render();
    const RobotReport report = show(back, at);
    found = report.measured.has_value();
    if (found) {
      EXPECT_LT((report.measured->pose.position() - Eigen::Vector2d(-0.6, 0.4)).norm(), 0.01);
    }
  }
  EXPECT_TRUE(found);
}

// A look is good to 8 mm: what is seen is followed, and said to be the robot once that is clear, sooner than
// the search would come by again.
TEST(TrackerDepth, UnderANoisySensorAFindIsHeldUntilItsHeightIsClear) {
  Room room({0.3, 0.2, 1.0});
  room.depth.noise_m = 0.16;
  RobotSpec robot = room.robot();
  robot.initial_pose.reset();
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(robot);
  Frame frame = room.frame(0);
  RobotReport report;
  int at = 0;
  const auto show = [&] {
    room.depth.seed = static_cast<std::uint32_t>(at + 1);
    frame.depth = room.depth.render();
    frame.captured = at_frame(at++);
    report = tracker.process(frame).at(0);
  };
  while (at < 20 && report.reason.find("not clear") == std::string_view::npos) {
    show();
    EXPECT_FALSE(report.measured);
  }
  ASSERT_LT(at, 20);
  EXPECT_EQ(report.state, TrackState::searching);
  const int held = at;
  while (at < held + 4 && !report.measured) show();
  ASSERT_TRUE(report.measured);
  EXPECT_EQ(report.reason, "");
  EXPECT_LT((report.measured->pose.position() - Eigen::Vector2d(0.3, 0.2)).norm(), 0.003);
}

TEST(TrackerDepth, ASearchLooksAtThingsOfTheRobotsHeightFirst) {
  const Room room({0.9, -0.7, 1.0});  // in the last of six tiles
  RobotSpec robot = room.robot();
  robot.initial_pose.reset();
  Tracker tracker({room.picture.camera()}, quick());
  Tracker blind({room.picture.camera()}, quick());
  tracker.add(robot);
  blind.add(robot);
  const RobotReport first = tracker.process(room.frame(0)).at(0);
  EXPECT_TRUE(first.measured);
  EXPECT_EQ(first.reason, "") << "there is an observation";
  int frames = 0;
  while (!blind.process(room.frame(frames, false)).at(0).measured && frames < 20) ++frames;
  EXPECT_GE(frames, 3) << "tile by tile";
}

TEST(TrackerDepth, WhoWasCarriedAwayIsSearchedForAtOnce) {
  const Room before({-0.8, 0.6, 0.0});
  const Room after({0.9, -0.7, 1.0});
  for (const bool with_depth : {true, false}) {
    Tracker tracker({before.picture.camera()}, quick());
    tracker.add(before.robot());
    int frame = 0;
    for (; frame < 6; ++frame) tracker.process(before.frame(frame, with_depth));
    const Frame there = after.frame(frame, with_depth);
    int until = 0;
    for (bool found = false; !found && until < 60; ++until, ++frame) {
      Frame now = there;
      now.captured = at_frame(frame);
      found = tracker.process(now).at(0).measured.has_value();
    }
    if (with_depth) {
      EXPECT_LE(until, 2);
    }
    if (!with_depth) {
      EXPECT_GE(until, 20) << "it is waited for where it was";
    }
  }
}

TEST(TrackerDepth, MeasuresTheHeightOfARobotThatIsTracked) {
  const Room room({0.3, 0.2, 0.0});
  RobotSpec robot = room.robot();
  robot.surface_height_m = kHeight + 0.02;  // as somebody measured it, wrongly
  Tracker tracker({room.picture.camera()});
  tracker.add(robot);
  for (int i = 0; i < 12; ++i) tracker.process(room.frame(i));
  const SurfaceHeight height = tracker.views().at(0).measured_height;
  EXPECT_GE(height.looks(), 5);
  EXPECT_NEAR(height.height_m(), kHeight, 3 * height.sigma_m());
  EXPECT_LT(height.sigma_m(), 0.002);
  ASSERT_TRUE(tracker.floor_fit(0));
  EXPECT_NEAR(tracker.floor_fit(0)->offset_m, 3.0 * 0.015, 0.003) << "the sensor reads 4.5 cm too near";
  EXPECT_THROW(tracker.floor_fit(1), std::out_of_range);
}

TEST(TrackerDepth, FramesWithoutDepthAreAsIfItCouldNotBeUsed) {
  const Room room({0.3, 0.2, 0.0});
  TrackerConfig off;
  off.depth.use = false;
  Tracker may({room.picture.camera()});
  Tracker may_not({room.picture.camera()}, off);
  Tracker has_it({room.picture.camera()}, off);
  for (Tracker* tracker : {&may, &may_not, &has_it}) tracker->add(room.robot());
  for (int i = 0; i < 5; ++i) {
    const auto& shown = i == 3 ? room.covered() : room;
    const RobotReport a = may.process(shown.frame(i, false)).at(0);
    const RobotReport b = may_not.process(shown.frame(i, false)).at(0);
    const RobotReport c = has_it.process(shown.frame(i, true)).at(0);
    ASSERT_EQ(a.measured.has_value(), b.measured.has_value());
    EXPECT_EQ(a.state, b.state);
    EXPECT_EQ(a.state, c.state);
    if (a.measured) {
      EXPECT_EQ(a.measured->pose, b.measured->pose);
    }
    if (a.measured) {
      EXPECT_EQ(a.measured->pose, c.measured->pose);
    }
  }
  EXPECT_FALSE(may.floor_fit(0)) << "nothing was kept for a depth that never came";
  EXPECT_FALSE(has_it.floor_fit(0));
  EXPECT_EQ(may.views().at(0).measured_height.looks(), 0);
}

TEST(TrackerDepth, TheBaselineReadsTheSensorsOwnDepthUnlessAskedOtherwise) {
  Room room({0.8, 0.5, 0.0});
  room.picture.noise = 0.0;
  room.picture.floor_speckle = 0;  // it finds large robots on plain floors only
  room.picture.pictures[0].image = test::corner_picture(41, 350);
  room.depth.boxes[0].length = room.depth.boxes[0].width = 0.35;
  room.depth.noise_m = 0.001;
  room.depth.error = [](double z, double, double) { return 1.0 / (1.0 / z + 0.02) - z; };
  RobotSpec robot = room.robot();
  robot.detector = DetectorKind::homography;
  const auto error = [&](bool correct) {
    TrackerConfig config = quick();
    config.depth.correct_homography = correct;
    Tracker tracker({room.picture.camera()}, config);
    tracker.add(robot);
    Frame frame = room.frame(0);
    tracker.process(frame);
    frame.captured = at_frame(1);
    const RobotReport report = tracker.process(frame).at(0);
    return report.measured ? (report.measured->pose.position() - Eigen::Vector2d(0.8, 0.5)).norm() : 1.0;
  };
  // 16 cm too near, at 0.33 m to the side for each metre: 5 cm.
  EXPECT_LT(error(true), 0.012);
  EXPECT_NEAR(error(false), 0.05, 0.012);
}

}  // namespace
}  // namespace skylight
