#include "service/calibration/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace skylight::calibration {
namespace {

constexpr int kMany = 10;  ///< corners in a cell

struct Region {
  const char* name;
  int first_column;
  int last_column;
  int first_row;
  int last_row;
};

/// Where lenses bend most is looked at apart.
constexpr std::array<Region, 9> kRegions{{{"the top left corner", 0, 1, 0, 1},
                                          {"the top edge", 2, 5, 0, 1},
                                          {"the top right corner", 6, 7, 0, 1},
                                          {"the left edge", 0, 1, 2, 3},
                                          {"the middle", 2, 5, 2, 3},
                                          {"the right edge", 6, 7, 2, 3},
                                          {"the bottom left corner", 0, 1, 4, 5},
                                          {"the bottom edge", 2, 5, 4, 5},
                                          {"the bottom right corner", 6, 7, 4, 5}}};

int at(const Coverage& coverage, int row, int column) {
  return coverage.corners[static_cast<std::size_t>(row * Coverage::kColumns + column)];
}

/// Half of the region's cells hold a corner.
bool covered(const Coverage& coverage, const Region& region) {
  int cells = 0;
  int held = 0;
  for (int row = region.first_row; row <= region.last_row; ++row) {
    for (int column = region.first_column; column <= region.last_column; ++column, ++cells)
      held += at(coverage, row, column) > 0 ? 1 : 0;
  }
  return 2 * held >= cells;
}

}  // namespace

double Coverage::share() const {
  const auto held = std::count_if(corners.begin(), corners.end(), [](int count) { return count > 0; });
  return static_cast<double>(held) / static_cast<double>(corners.size());
}

void add_view(Coverage& coverage, const std::vector<Pixel>& pixels, const Eigen::Vector3d& normal,
              const Eigen::Vector2d& picture_px) {
  for (const Pixel& pixel : pixels) {
    const int column = static_cast<int>(std::floor((pixel.x() + 0.5) / picture_px.x() * Coverage::kColumns));
    const int row = static_cast<int>(std::floor((pixel.y() + 0.5) / picture_px.y() * Coverage::kRows));
    if (column < 0 || row < 0 || column >= Coverage::kColumns || row >= Coverage::kRows) continue;
    ++coverage.corners[static_cast<std::size_t>(row * Coverage::kColumns + column)];
  }
  const Eigen::Vector2d lean = normal.head<2>() / normal.norm();
  if (lean.norm() < std::sin(Coverage::kTilted)) {
    ++coverage.flat;
    return;
  }
  // A board that faces to the right has its left edge nearer.
  if (std::abs(lean.x()) >= std::abs(lean.y())) {
    ++coverage.tilted[lean.x() > 0.0 ? 0 : 1];
  } else {
    ++coverage.tilted[lean.y() > 0.0 ? 2 : 3];
  }
}

std::vector<std::string> missing_views(const Coverage& coverage) {
  std::vector<std::string> missing;
  std::string regions;
  for (const Region& region : kRegions) {
    if (!covered(coverage, region)) regions += (regions.empty() ? "" : ", ") + std::string(region.name);
  }
  if (!regions.empty())
    missing.push_back("no corners in " + regions + " of the picture: hold the board there");
  constexpr std::array<const char*, 4> kEdges{"left", "right", "upper", "lower"};
  std::string tilts;
  for (std::size_t i = 0; i < kEdges.size(); ++i) {
    if (coverage.tilted[i] == 0) tilts += (tilts.empty() ? "" : ", ") + std::string(kEdges[i]);
  }
  if (!tilts.empty())
    missing.push_back(
        "no view tilted by 15 to 45 degrees with this edge of the board nearest to the camera: " + tilts);
  return missing;
}

std::vector<std::string> coverage_map(const Coverage& coverage) {
  std::vector<std::string> lines;
  for (int row = 0; row < Coverage::kRows; ++row) {
    std::string& line = lines.emplace_back();
    for (int column = 0; column < Coverage::kColumns; ++column) {
      const int count = at(coverage, row, column);
      line += count == 0 ? '.' : count < kMany ? '+' : '#';
    }
  }
  return lines;
}

}  // namespace skylight::calibration
