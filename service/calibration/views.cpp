#include "service/calibration/views.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/calib3d.hpp>

#include "service/calibration/median.hpp"
#include "service/calibration/text.hpp"
#include "tracker/grey.hpp"

namespace skylight::calibration {
namespace {

/// Pictures without the board that are searched for what is wrong with its description: it is slow.
constexpr int kSuspects = 3;
constexpr int kSuspectAgainAfter = 25;
/// Motion is judged between pictures no further apart, s.
constexpr double kMotionWithin = 1.0;

/// Mean distance of the corners that both show; none where these are less than half.
std::optional<double> distance_px(const BoardView& a, const BoardView& b) {
  double sum = 0.0;
  std::size_t both = 0;
  std::size_t j = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    // Corners mostly stand in the same order: the search goes on from the last one found.
    for (std::size_t tried = 0; tried < b.points.size(); ++tried, j = (j + 1) % b.points.size()) {
      if (a.points[i] != b.points[j]) continue;
      sum += (a.pixels[i] - b.pixels[j]).norm();
      ++both;
      break;
    }
  }
  if (2 * both < std::max(a.points.size(), b.points.size()) || both == 0) return std::nullopt;
  return sum / static_cast<double>(both);
}

float grey_at(const cv::Mat& grey, const Pixel& pixel) {
  const int u = std::clamp(static_cast<int>(std::floor(pixel.x())), 0, grey.cols - 2);
  const int v = std::clamp(static_cast<int>(std::floor(pixel.y())), 0, grey.rows - 2);
  const auto x = static_cast<float>(pixel.x() - u);
  const auto y = static_cast<float>(pixel.y() - v);
  const auto at = [&](int row, int column) {
    return static_cast<float>(grey.at<std::uint8_t>(v + row, u + column));
  };
  return (1 - y) * ((1 - x) * at(0, 0) + x * at(0, 1)) + y * ((1 - x) * at(1, 0) + x * at(1, 1));
}

/// Of the edge between two neighbouring corners, across its middle.
double edge_width_px(const cv::Mat& grey, const Pixel& a, const Pixel& b) {
  constexpr double kStep = 0.5;
  const Eigen::Vector2d along = b - a;
  const Eigen::Vector2d across = Eigen::Vector2d(-along.y(), along.x()).normalized();
  const double reach = 0.4 * along.norm();  // within the squares on both sides
  float low = 255.0F;
  float high = 0.0F;
  float steepest = 0.0F;
  std::optional<float> before;
  for (double t = -reach; t <= reach; t += kStep) {
    const float value = grey_at(grey, 0.5 * (a + b) + t * across);
    low = std::min(low, value);
    high = std::max(high, value);
    if (before) steepest = std::max(steepest, std::abs(value - *before));
    before = value;
  }
  return steepest > 0.0F ? kStep * static_cast<double>((high - low) / steepest) : 2.0 * reach;
}

/// The board's normal in the optical frame, towards the camera.
std::optional<Eigen::Vector3d> normal_of(const BoardView& view, const CameraModel& camera) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> tangents;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const auto ray = camera.ray_from_pixel(view.pixels[i]);
    if (!ray || ray->z() < 0.05) continue;
    points.emplace_back(view.points[i].x(), view.points[i].y(), 0.0);
    tangents.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
  }
  if (points.size() < 4) return std::nullopt;
  cv::Vec3d turn;
  cv::Vec3d way;
  if (!cv::solvePnP(points, tangents, cv::Matx33d::eye(), cv::noArray(), turn, way, false, cv::SOLVEPNP_IPPE))
    return std::nullopt;
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  return Eigen::Vector3d(rotation(0, 2), rotation(1, 2), rotation(2, 2));
}

}  // namespace

std::optional<double> edge_width_px(const cv::Mat& picture, const Board& board, const BoardSighting& seen) {
  const cv::Mat grey = grey_of(picture);
  const int columns = board.corner_columns();
  std::vector<const Pixel*> at(static_cast<std::size_t>(columns * board.corner_rows()), nullptr);
  for (std::size_t i = 0; i < seen.corners.size(); ++i)
    at[static_cast<std::size_t>(seen.corners[i])] = &seen.pixels[i];
  std::vector<double> widths;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const std::size_t right = i + 1;
    const std::size_t below = i + static_cast<std::size_t>(columns);
    if (at[i] == nullptr) continue;
    if (right % static_cast<std::size_t>(columns) != 0 && at[right] != nullptr)
      widths.push_back(edge_width_px(grey, *at[i], *at[right]));
    if (below < at.size() && at[below] != nullptr) widths.push_back(edge_width_px(grey, *at[i], *at[below]));
  }
  if (widths.empty()) return std::nullopt;
  return median(std::move(widths));
}

Coverage coverage_of(const std::vector<BoardView>& views, const Intrinsics& roughly) {
  const CameraModel camera(roughly, Eigen::Isometry3d::Identity());
  Coverage coverage;
  for (const BoardView& view : views) {
    const auto normal = normal_of(view, camera);
    add_view(coverage, view.pixels, normal.value_or(-Eigen::Vector3d::UnitZ()),
             Eigen::Vector2d(roughly.width_px, roughly.height_px));
  }
  return coverage;
}

ViewCollector::ViewCollector(Board board, const CollectOptions& options)
    : board_(std::move(board)), options_(options), points_(board_points(board_)) {}

void ViewCollector::suspect(const cv::Mat& picture) {
  const int miss = misses_++ - options_.suspect_after;
  if (!views_.empty() || !suspicion_.empty() || miss < 0) return;
  if (miss < kSuspects || miss % kSuspectAgainAfter == 0) suspicion_ = suspect_board(picture, board_);
}

std::string ViewCollector::objection(const cv::Mat& picture, const BoardSighting& seen, const BoardView& view,
                                     const std::optional<Seen>& before, std::optional<Time> captured) const {
  const double width = size_.width;
  if (options_.most_motion > 0.0 && before && captured) {
    const double elapsed = to_seconds(*captured - before->captured);
    const auto moved = distance_px(view, before->view);
    if (elapsed > 0.0 && elapsed <= kMotionWithin &&
        moved.value_or(width) > options_.most_motion * width * elapsed)
      return "the board moves: hold it still for a moment";
  }
  if (options_.widest_edge_px > 0.0) {
    const double edge = edge_width_px(picture, board_, seen).value_or(0.0);
    if (edge > options_.widest_edge_px)
      return "blurred: the edges of its squares are " + fixed(edge, 1) + " px wide, at most " +
             fixed(options_.widest_edge_px, 1) + " px are good";
  }
  const bool known = std::any_of(views_.begin(), views_.end(), [&](const BoardView& other) {
    return distance_px(view, other).value_or(width) < options_.near_share * width;
  });
  return known ? "much like another picture" : "";
}

LookedAt ViewCollector::look(const std::string& name, const cv::Mat& picture, std::optional<Time> captured) {
  if (size_.empty()) size_ = picture.size();
  if (picture.size() != size_)
    throw std::invalid_argument(name + " is " + std::to_string(picture.cols) + " x " +
                                std::to_string(picture.rows) + " px, the pictures before it " +
                                std::to_string(size_.width) + " x " + std::to_string(size_.height) +
                                " px: take all with the same settings");
  LookedAt out;
  out.seen = find_board(picture, board_, out.why_not);
  if (!out.seen) {
    newest_.reset();
    suspect(picture);
    return out;
  }
  BoardView view{.name = name, .points = {}, .pixels = out.seen->pixels};
  for (const int corner : out.seen->corners) view.points.push_back(points_[static_cast<std::size_t>(corner)]);
  out.why_not = objection(picture, *out.seen, view, newest_, captured);
  out.taken = out.why_not.empty();
  if (captured) newest_ = Seen{view, *captured};
  if (!out.taken) return out;
  suspicion_.clear();
  views_.push_back(std::move(view));
  return out;
}

}  // namespace skylight::calibration
