#include "sim/world/walk.hpp"

#include <cmath>

#include <Eigen/Core>

namespace skylight::sim {

std::optional<Pose2> person_at(const PersonSpec& person, Duration time) {
  if (time < from_seconds(person.start_s)) return std::nullopt;
  const auto place = [&](std::size_t i) {
    const auto& point = person.path_m[i % person.path_m.size()];
    return Eigen::Vector2d(point[0], point[1]);
  };
  const std::size_t legs = person.path_m.size() - (person.loop ? 0 : 1);
  double total = 0.0;
  for (std::size_t i = 0; i < legs; ++i) total += (place(i + 1) - place(i)).norm();
  double way = person.speed_mps * (to_seconds(time) - person.start_s);
  if (person.loop && total > 0.0) way = std::fmod(way, total);
  if (way > total) return std::nullopt;
  for (std::size_t i = 0; i < legs; ++i) {
    const Eigen::Vector2d leg = place(i + 1) - place(i);
    const double length = leg.norm();
    if (length > 0.0 && (way <= length || i + 1 == legs)) {
      const Eigen::Vector2d at = place(i) + leg * std::min(1.0, way / length);
      return Pose2{at.x(), at.y(), std::atan2(leg.y(), leg.x())};
    }
    way -= length;
  }
  return Pose2{place(0).x(), place(0).y(), 0.0};  // a path of places that lie on one another
}

}  // namespace skylight::sim
