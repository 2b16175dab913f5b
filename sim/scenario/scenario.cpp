#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

Scenario::Scenario() = default;

std::vector<RobotSpec> all_robots(const Scenario& scenario) {
  std::vector<RobotSpec> robots;
  for (const RobotSpec& first : scenario.robots) {
    for (int i = 0; i < first.copies.count; ++i) {
      RobotSpec robot = first;
      robot.copies = {};
      if (i > 0) robot.id.append("-").append(std::to_string(i + 1));
      robot.start.x_m += first.copies.spacing_m[0] * (i % first.copies.per_row);
      robot.start.y_m += first.copies.spacing_m[1] * (i / first.copies.per_row);
      robots.push_back(robot);
    }
  }
  return robots;
}

}  // namespace skylight::sim
