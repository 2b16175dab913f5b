// Frames of a simulated room, drawn once and kept in memory, and the robots as a tracker is told of them.
#pragma once

#include <string>
#include <vector>

#include "sim/scenario/scenario.hpp"
#include "tracker/tracker.hpp"

namespace skylight::bench {

struct RoomOptions {
  int robots = 1;  ///< 1 to 10 Waffle Pis
  bool depth = false;
};

/// A 6 x 6 m room with speckled floor under the camera of sim/scenarios/straight.json; every other robot
/// drives slowly in a circle, the rest stand. Endless.
sim::Scenario room(const RoomOptions& options);
/// What room() is, for a benchmark's label.
std::string room_label(const RoomOptions& options);

struct Recording {
  CameraModel camera;
  std::vector<RobotSpec> robots;  ///< detector `orb`, placed where they truly stand in the first frame
  std::vector<cv::Mat> images;
  std::vector<cv::Mat> depths;  ///< one for each image, or none
};

/// room() recorded; drawn at the first call for it.
const Recording& recording(const RoomOptions& options);
inline const Recording& recording(int robots) {
  return recording({.robots = robots});
}

/// A recording played for ever, forwards and backwards, so that the robots move without a jump.
class Player {
 public:
  explicit Player(const Recording& recording) : recording_(recording) {}
  Frame next();

 private:
  const Recording& recording_;
  std::uint64_t played_ = 0;
};

}  // namespace skylight::bench
