// Which parts of the picture the boards were held in, and how they were tilted: where a calibration is
// guessed rather than measured, and which view would help.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tracker/types.hpp"

namespace skylight::calibration {

struct Coverage {
  static constexpr int kColumns = 8;
  static constexpr int kRows = 6;
  /// Corners per cell of the picture, row by row from the top left.
  std::array<int, kColumns * kRows> corners{};
  /// Views whose board is tilted by more than kTilted with its left, right, upper or lower edge the nearest.
  std::array<int, 4> tilted{};
  int flat = 0;  ///< views tilted by less

  static constexpr double kTilted = 0.26;  ///< rad, 15 degrees

  double share() const;  ///< of the cells that hold a corner, 0 to 1
};

/// One view for the record: its pixels, and the board's normal in the optical frame (towards the camera).
void add_view(Coverage& coverage, const std::vector<Pixel>& pixels, const Eigen::Vector3d& normal,
              const Eigen::Vector2d& picture_px);

/// Which views are missing, one sentence each; empty where nothing is.
std::vector<std::string> missing_views(const Coverage& coverage);

/// The map as text, one line a row of cells: `.` none, `+` a few corners, `#` many.
std::vector<std::string> coverage_map(const Coverage& coverage);

}  // namespace skylight::calibration
