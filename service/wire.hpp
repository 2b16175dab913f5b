// How things look on the wire: JSON in metres, radians and Unix seconds; never a NaN.
#pragma once

#include <string>

#include "service/event_log.hpp"
#include "service/json.hpp"
#include "service/pose_query.hpp"

namespace skylight::service {

std::string_view to_string(SourceState state);

Json to_json(const PoseAnswer& answer, Time now);
/// `now`: the answer for the present, whose state and reason are shown.
Json to_json(const RobotSnapshot& robot, const PoseAnswer& now);
Json to_json(const FeedStatus& feed);
Json to_json(const Intrinsics& intrinsics);
Json to_json(const FloorFit& floor);
Json to_json(const CameraSnapshot& camera);
Json to_json(const Event& event);
/// {position_m, quaternion_xyzw}
Json to_json(const Eigen::Isometry3d& pose);

}  // namespace skylight::service
