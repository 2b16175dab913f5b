// How things look on the wire: JSON in metres, radians and Unix seconds; never a NaN.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "service/pose_query.hpp"

namespace skylight::service {

/// Keys stay in the order in which they are written: people read this.
using Json = nlohmann::ordered_json;

std::string_view to_string(SourceState state);

Json to_json(const PoseAnswer& answer, Time now);
/// `now`: the answer for the present, whose state and reason are shown.
Json to_json(const RobotSnapshot& robot, const PoseAnswer& now);
Json to_json(const FeedStatus& feed);
Json to_json(const CameraSnapshot& camera);
/// {position_m, quaternion_xyzw}
Json to_json(const Eigen::Isometry3d& pose);

}  // namespace skylight::service
