#include "tracker/search.hpp"

#include <algorithm>

namespace skylight {
namespace {

// Tiles along one side, and where the i-th begins: evenly spread, the last one ends at the border.
int tile_count(int side, int tile, int overlap) {
  if (side <= tile) return 1;
  return 1 + (side - tile + (tile - overlap) - 1) / (tile - overlap);
}

int tile_begin(int side, int tile, int count, int i) {
  return count == 1 ? 0 : (side - tile) * i / (count - 1);
}

}  // namespace

cv::Rect Sweep::next(const cv::Size& size, int tile_px, int overlap_px) {
  const int tile = std::max(tile_px, 2 * overlap_px);
  const int across = tile_count(size.width, tile, overlap_px);
  const int down = tile_count(size.height, tile, overlap_px);
  const int i = index_++ % (across * down);
  const cv::Rect at(tile_begin(size.width, tile, across, i % across),
                    tile_begin(size.height, tile, down, i / across), tile, tile);
  return at & cv::Rect({}, size);
}

std::optional<cv::Rect> Sweep::next(const cv::Size& size, int tile_px, int overlap_px,
                                    const std::function<bool(const cv::Rect&)>& skip) {
  const cv::Rect first = next(size, tile_px, overlap_px);
  cv::Rect tile = first;
  while (skip(tile)) {
    tile = next(size, tile_px, overlap_px);
    if (tile == first) return std::nullopt;
  }
  return tile;
}

}  // namespace skylight
