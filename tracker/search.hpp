// The whole-floor search: a sweep over parts of the frame that carries on from frame to frame.
#pragma once

#include <functional>
#include <optional>

#include <opencv2/core/types.hpp>

namespace skylight {

/// Covers a picture with overlapping tiles, one per call, for ever.
class Sweep {
 public:
  /// The next tile of a picture of `size`; neighbours overlap by `overlap_px`, so that a robot that wide
  /// lies whole in one of them. The tile is grown where it would be less than twice the overlap.
  cv::Rect next(const cv::Size& size, int tile_px, int overlap_px);
  /// The next one that `skip` does not want left out; none where it wants all of them to be.
  std::optional<cv::Rect> next(const cv::Size& size, int tile_px, int overlap_px,
                               const std::function<bool(const cv::Rect&)>& skip);
  void restart() { index_ = 0; }

 private:
  int index_ = 0;
};

}  // namespace skylight
