// Fewer points, the same look: what a plot of some hundred pixels can show of tens of thousands of points.
#pragma once

#include <cstddef>
#include <vector>

namespace skylight::service::report {

struct Point {
  double x = 0.0;
  double y = 0.0;
};

/// Of a line, in pixels. Along a rising x each pixel column keeps its first, lowest, highest and last point
/// (M4; Jugel et al., VLDB 2014), so no peak is lost. Then points go that lie within 0.15 px of the line
/// without them (Douglas and Peucker, 1973). Ends are kept.
std::vector<Point> thin_line(const std::vector<Point>& points);

/// Which of a cloud's points to draw, rising: one in each cell of a grid. Cells are half a pixel wide, and
/// wider as long as more than `most` points are left. Leftmost, rightmost, lowest and highest are kept.
std::vector<std::size_t> thin_dots(const std::vector<Point>& points, std::size_t most = 4000);

}  // namespace skylight::service::report
