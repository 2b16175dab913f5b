// Acquisition where ORB finds next to nothing (a few flat patches of colour): correlation of a disc of the
// picture, turned through all headings, with the floor at a coarse resolution.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"

namespace skylight {

struct CorrelateConfig {
  int cells = 14;           ///< across the picture's shorter side, 6 to 40
  int headings = 36;        ///< 4 to 360
  int places = 4;           ///< most conspicuous places that are looked at per search
  double min_score = 0.55;  ///< correlation below which a place is dropped, 0 to 1
};

/// The disc of the picture at every heading, means removed.
struct CorrelateModel {
  double cell_m = 0.0;
  int radius_cells = 0;
  int channels = 1;
  std::vector<Eigen::Vector2i> cells;  ///< of the disc: offsets in map x and y
  std::vector<double> yaw;             ///< per heading
  Eigen::MatrixXf discs;               ///< one column per heading, cells of channel 0, then 1, ...; norm 1
};

CorrelateModel make_correlate_model(const Appearance& appearance, const CorrelateConfig& config);

struct CorrelatePose {
  Pose2 pose{};        ///< of base_link, to about a cell and half a heading step
  double score = 0.0;  ///< correlation, 0 to 1
};

/// A square part of the robot's plane in `map`.
struct FloorPart {
  Eigen::Vector2d centre_m;
  double half_side_m = 0.0;
};

/// Best first. Work grows with the part's area over the cell's (bounded: a part larger than 200 cells a
/// side is cut down around its centre).
std::vector<CorrelatePose> find_correlate(const CorrelateModel& model, const Appearance& appearance,
                                          const Frame& frame, const CameraModel& camera,
                                          const FloorPart& part, double surface_height_m,
                                          const CorrelateConfig& config);

}  // namespace skylight
