// The picture on a robot's plate: drawn from its seed or read from a file, as print and as texture.
#pragma once

#include "sim/render/render.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/simulation.hpp"

namespace skylight::sim {

/// The artwork of the scenario's robot with this index. Throws std::invalid_argument where its file is no
/// picture, or does not fit the plate.
RobotPicture make_picture(const Scenario& scenario, std::size_t robot);

/// How that robot looks to the renderer: the artwork laid on its plate.
RobotLook make_look(const RobotSpec& robot, const RobotPicture& picture);

}  // namespace skylight::sim
