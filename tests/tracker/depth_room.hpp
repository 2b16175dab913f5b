// One robot under a camera with depth, as a picture and as a box; for tests of the whole tracker.
#pragma once

#include "tests/support/flat_scene.hpp"
#include "tests/tracker/depth_scene.hpp"
#include "tracker/tracker.hpp"

namespace skylight::test {

inline constexpr double kHeight = 0.1;
inline constexpr double kSide = 0.24;

inline Time at_frame(int frame) {
  return Time{} + from_seconds(1000.0 + frame / 30.0);
}

struct Room {
  FlatScene picture;
  DepthScene depth;

  explicit Room(const Pose2& pose) {
    picture.noise = 2.0;
    picture.floor_speckle = 500;
    picture.pictures = {{.image = corner_picture(51), .height_m = kHeight, .pose = pose}};
    depth.noise_m = 0.012;
    depth.error = [](double z, double, double) { return 1.0 / (1.0 / z + 0.005) - z; };
    depth.boxes = {{.x = pose.x, .y = pose.y, .length = kSide, .width = kSide, .height = kHeight}};
  }

  Frame frame(int at, bool with_depth = true) const {
    Frame out = picture.render(at_frame(at));
    DepthScene now = depth;
    now.seed = static_cast<std::uint32_t>(at + 1);
    if (with_depth) out.depth = now.render();
    return out;
  }

  // A board over the robot, 1 m above the floor.
  Room covered() const {
    Room out = *this;
    const DepthBox board{
        .x = depth.boxes[0].x, .y = depth.boxes[0].y, .length = 0.5, .width = 0.5, .height = 1.0};
    out.depth.boxes.push_back(board);
    const Pixel corner = picture.pixel(board.x - 0.25, board.y + 0.25, 1.0);
    const int side = static_cast<int>(0.5 / picture.metres_per_px(1.0));
    out.picture.covers_px = {{static_cast<int>(corner.x()), static_cast<int>(corner.y()), side, side}};
    return out;
  }

  RobotSpec robot() const {
    return {.id = "anna",
            .appearance = appearance_of(picture.pictures[0]),
            .initial_pose = picture.pictures[0].pose};
  }
};

inline TrackerConfig quick() {
  TrackerConfig config;
  config.depth.learn_frames = 1;
  config.search = {.steps_per_frame = 1, .first_steps_per_frame = 1};
  return config;
}

}  // namespace skylight::test
