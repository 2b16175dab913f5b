// What is on a robot's plate: a picture, drawn from its seed or read from a file, and a tag; as print and as
// texture.
#pragma once

#include <optional>

#include "sim/render/render.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/simulation.hpp"

namespace skylight::sim {

/// The artwork of the scenario's robot with this index: its picture with its tag on it, each if it has one,
/// and a hole where the lidar stands. Alpha 0 where nothing is printed: all over for a bare plate. Throws
/// std::invalid_argument, naming key path, reason and range, where a file is no picture, something does not
/// fit the plate, or there is no such tag.
RobotPicture make_picture(const Scenario& scenario, std::size_t robot);

/// Where a tag lies: its middle, from the middle of the robot's plate, robot axes.
struct TagPlace {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw = 0.0;        ///< radians, as TagSpec::yaw_deg
  double printed_m = 0.0;  ///< edge of all that is printed, with its white rim
};
/// None without a tag. Throws as make_picture().
std::optional<TagPlace> tag_place(const Scenario& scenario, std::size_t robot);

/// The same artwork with something lying on it: a card on the tag alone (nothing changes without one), or a
/// cloth on the whole plate.
RobotPicture make_covered(const Scenario& scenario, std::size_t robot, bool tag_only);

/// How that robot looks to the renderer: the artwork laid on its plate.
RobotLook make_look(const RobotSpec& robot, const RobotPicture& picture);

}  // namespace skylight::sim
