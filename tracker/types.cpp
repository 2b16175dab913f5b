#include "tracker/types.hpp"

#include <array>

namespace skylight {

std::string_view to_string(TrackState state) {
  switch (state) {
    case TrackState::searching:
      return "searching";
    case TrackState::calibrating:
      return "calibrating";
    case TrackState::tracking:
      return "tracking";
    case TrackState::predicting:
      return "predicting";
    case TrackState::occluded:
      return "occluded";
    case TrackState::lost:
      return "lost";
  }
  return "unknown";  // only a value that no enumerator has
}

std::string_view to_string(PoseKind kind) {
  switch (kind) {
    case PoseKind::measured:
      return "measured";
    case PoseKind::filtered:
      return "filtered";
    case PoseKind::smoothed:
      return "smoothed";
    case PoseKind::predicted:
      return "predicted";
  }
  return "unknown";
}

std::string_view to_string(PoseSource source) {
  switch (source) {
    case PoseSource::orb:
      return "orb";
    case PoseSource::align:
      return "align";
    case PoseSource::homography:
      return "homography";
    case PoseSource::apriltag:
      return "apriltag";
    case PoseSource::depth:
      return "depth";
    case PoseSource::prediction:
      return "prediction";
  }
  return "unknown";
}

std::optional<PoseKind> pose_kind_from_string(std::string_view text) {
  constexpr std::array kKinds{PoseKind::measured, PoseKind::filtered, PoseKind::smoothed,
                              PoseKind::predicted};
  for (const PoseKind kind : kKinds) {
    if (text == to_string(kind)) return kind;
  }
  return std::nullopt;
}

}  // namespace skylight
