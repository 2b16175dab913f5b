// Views of a board, picture by picture: which add something to a calibration of the intrinsics, and why the
// others do not. For pictures from files, and for a camera before which somebody moves a board.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/intrinsics.hpp"
#include "tracker/camera.hpp"

namespace skylight::calibration {

struct CollectOptions {
  /// A view nearer to an earlier one adds nothing: mean distance of corners, as a share of the picture's
  /// width.
  double near_share = 0.01;
  /// A board that moves faster makes a blurred or skewed view: picture widths per second; 0: whatever it
  /// does. Counts between pictures less than a second apart.
  double most_motion = 0.0;
  /// Width of the edges of squares above which a view is blurred, px; 0: whatever they are.
  double widest_edge_px = 0.0;
  /// As long as there is no view, what is wrong with the board's description is looked for (which is slow)
  /// after so many pictures without the board, in a few of them at first and then now and again.
  int suspect_after = 0;
};

/// For a live camera.
inline constexpr CollectOptions kLiveViews{
    .near_share = 0.05, .most_motion = 0.05, .widest_edge_px = 5.0, .suspect_after = 8};

/// What became of a picture.
struct LookedAt {
  std::optional<BoardSighting> seen;
  bool taken = false;
  std::string why_not;  ///< where it was not taken
};

class ViewCollector {
 public:
  explicit ViewCollector(Board board, const CollectOptions& options = {});

  /// Throws std::invalid_argument where the picture has another size than those before. `captured` counts
  /// for the board's motion.
  LookedAt look(const std::string& name, const cv::Mat& picture, std::optional<Time> captured = {});

  const Board& board() const { return board_; }
  const std::vector<BoardView>& views() const { return views_; }
  const cv::Size& size() const { return size_; }  ///< of the pictures; empty before the first
  /// What may be wrong with the board's description, as long as no view was taken; empty where nothing is
  /// recognised.
  const std::string& suspicion() const { return suspicion_; }

 private:
  struct Seen {
    BoardView view;
    Time captured;
  };

  void suspect(const cv::Mat& picture);
  std::string objection(const cv::Mat& picture, const BoardSighting& seen, const BoardView& view,
                        const std::optional<Seen>& before, std::optional<Time> captured) const;

  Board board_;
  CollectOptions options_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<BoardView> views_;
  cv::Size size_;
  std::optional<Seen> newest_;
  int misses_ = 0;
  std::string suspicion_;
};

/// How wide the edges between squares are in the picture, px: the step from dark to light over its steepest
/// slope, the median over all edges between neighbouring corners. None where no two neighbours are seen.
std::optional<double> edge_width_px(const cv::Mat& picture, const Board& board, const BoardSighting& seen);

/// Where the views' corners are and how their boards are tilted, by a camera that may be known roughly.
Coverage coverage_of(const std::vector<BoardView>& views, const Intrinsics& roughly);

}  // namespace skylight::calibration
