// Corners in pictures: OpenCV's detectors, then corners to a fraction of a pixel, ordered as board.hpp says.
#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/dictionaries.hpp"
#include "tracker/grey.hpp"

namespace skylight::calibration {
namespace {

constexpr int kFewestCorners = 6;
/// Of a picture's longer side; larger ones are first searched at a smaller size.
constexpr int kSearchSide = 1280;
/// A marker's size against its square's is measured to so much.
constexpr double kMarkerTolerance = 0.07;
/// A smaller grid of corners is found in much that is no chessboard.
constexpr int kFewestColumns = 4;
/// A marker corner further from where the board has it than this share of a square contradicts the board.
constexpr double kMisplaced = 0.25;

using Corners = std::vector<cv::Point2f>;

/// A grid of corners, row by row.
class Grid {
 public:
  Grid(Corners& corners, int columns, int rows) : corners_(corners), columns_(columns), rows_(rows) {}

  const cv::Point2f& at(int row, int column) const {
    return corners_[static_cast<std::size_t>(row * columns_ + column)];
  }

  /// Rows go down as columns go right, so that the print is not seen from behind.
  void make_right_handed() {
    double turn = 0.0;
    for (int r = 0; r + 1 < rows_; ++r) {
      for (int c = 0; c + 1 < columns_; ++c) turn += (at(r, c + 1) - at(r, c)).cross(at(r + 1, c) - at(r, c));
    }
    if (turn >= 0.0) return;
    for (int r = 0; r < rows_; ++r)
      std::reverse(corners_.begin() + r * columns_, corners_.begin() + (r + 1) * columns_);
  }

  /// The square outside the bottom-left corner is dark, if that tells the two ends apart.
  void put_dark_square_at_bottom_left(const cv::Mat& grey) {
    if ((columns_ + rows_) % 2 == 0) return;
    double light = 0.0;
    for (int r = 0; r + 1 < rows_; ++r) {
      for (int c = 0; c + 1 < columns_; ++c) {
        const cv::Point2f middle = 0.25F * (at(r, c) + at(r + 1, c) + at(r, c + 1) + at(r + 1, c + 1));
        const cv::Point place(cvRound(middle.x), cvRound(middle.y));
        if (!cv::Rect({}, grey.size()).contains(place)) continue;
        // The innermost square at the bottom left touches the outer one corner to corner.
        const bool as_bottom_left = (rows_ - 2 - r + c) % 2 == 0;
        light += (as_bottom_left ? 1.0 : -1.0) * grey.at<std::uint8_t>(place);
      }
    }
    if (light > 0.0) std::reverse(corners_.begin(), corners_.end());
  }

  /// Half the side of a window around any corner that holds no other.
  int window() const {
    double nearest = std::numeric_limits<double>::max();
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        if (c + 1 < columns_) nearest = std::min(nearest, cv::norm(at(r, c + 1) - at(r, c)));
        if (r + 1 < rows_) nearest = std::min(nearest, cv::norm(at(r + 1, c) - at(r, c)));
      }
    }
    return std::clamp(static_cast<int>(0.35 * nearest), 2, 12);
  }

 private:
  Corners& corners_;
  int columns_;
  int rows_;
};

bool find_chessboard(const cv::Mat& grey, const cv::Size& size, Corners& corners) {
  constexpr int kFlags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  const double scale = static_cast<double>(kSearchSide) / std::max(grey.cols, grey.rows);
  if (scale < 1.0) {
    cv::Mat smaller;
    cv::resize(grey, smaller, {}, scale, scale, cv::INTER_AREA);
    if (cv::findChessboardCorners(smaller, size, corners, kFlags)) {
      for (cv::Point2f& corner : corners) {
        corner.x = static_cast<float>((corner.x + 0.5) / scale - 0.5);
        corner.y = static_cast<float>((corner.y + 0.5) / scale - 0.5);
      }
      return true;
    }
    if (scale > 0.5) return false;  // what is not seen at more than half the size is not seen in full
  }
  return cv::findChessboardCorners(grey, size, corners, kFlags);
}

void refine(const cv::Mat& grey, int window, Corners& corners) {
  const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-3);
  cv::cornerSubPix(grey, corners, {window, window}, {-1, -1}, until);
}

BoardSighting sighting_of(const Corners& corners, const std::vector<int>& ids) {
  BoardSighting out;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    out.corners.push_back(ids.empty() ? static_cast<int>(i) : ids[i]);
    out.pixels.emplace_back(corners[i].x, corners[i].y);
  }
  return out;
}

std::optional<BoardSighting> find_chessboard_in(const cv::Mat& grey, const Board& board, std::string& why) {
  Corners corners;
  const cv::Size size(board.columns, board.rows);
  if (!find_chessboard(grey, size, corners)) {
    why = "no chessboard of " + std::to_string(board.columns) + "x" + std::to_string(board.rows) +
          " inner corners is seen whole";
    return std::nullopt;
  }
  Grid grid(corners, board.columns, board.rows);
  grid.make_right_handed();
  grid.put_dark_square_at_bottom_left(grey);
  refine(grey, grid.window(), corners);
  return sighting_of(corners, {});
}

struct Markers {
  std::vector<int> ids;
  std::vector<Corners> corners;
};

Markers find_markers(const cv::Mat& grey, const std::string& dictionary_name) {
  Markers found;
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->minMarkerPerimeterRate = 0.01;
  cv::aruco::detectMarkers(grey, dictionary(dictionary_name), found.corners, found.ids, parameters);
  return found;
}

cv::Ptr<cv::aruco::CharucoBoard> charuco_board(const Board& board) {
  return cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.square_m),
                                         static_cast<float>(board.marker_m), dictionary(board.dictionary));
}

/// Half the side of a window around any corner that leaves the markers in the white squares out.
int charuco_window(const Board& board, const Corners& corners) {
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) nearest = std::min(nearest, cv::norm(corners[i] - corners[j]));
  }
  return std::clamp(static_cast<int>(0.5 * (1.0 - board.marker_m / board.square_m) * nearest), 2, 8);
}

/// The board's plane from the picture near the middle of what is seen; none where all lies in a line.
std::optional<cv::Mat> plane_from_picture(const cv::aruco::CharucoBoard& board, const Corners& corners,
                                          const std::vector<int>& ids) {
  Corners places;
  for (const int id : ids) {
    const cv::Point3f& place = board.chessboardCorners[static_cast<std::size_t>(id)];
    places.emplace_back(place.x, place.y);
  }
  cv::Mat homography = cv::findHomography(corners, places, cv::LMEDS);
  if (homography.empty()) return std::nullopt;
  return homography;
}

/// Empty, or how the markers contradict the board: their places, or their size against the squares.
std::string contradiction(const cv::aruco::CharucoBoard& board, const Markers& markers, const cv::Mat& grey,
                          const cv::Mat& plane_from_pixel) {
  std::size_t misplaced = 0;
  std::vector<double> sides;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    const auto at = std::find(board.ids.begin(), board.ids.end(), markers.ids[i]);
    if (at == board.ids.end()) continue;
    const auto& stated = board.objPoints[static_cast<std::size_t>(at - board.ids.begin())];
    Corners seen = markers.corners[i];
    refine(grey, 3, seen);
    cv::perspectiveTransform(seen, seen, plane_from_pixel);
    cv::Point2f middle(0, 0);
    for (std::size_t k = 0; k < 4; ++k) {
      middle += 0.25F * (seen[k] - cv::Point2f(stated[k].x, stated[k].y));
      sides.push_back(cv::norm(seen[k] - seen[(k + 1) % 4]));
    }
    if (cv::norm(middle) > kMisplaced * board.getSquareLength()) ++misplaced;
  }
  if (3 * misplaced > markers.ids.size())
    return "its markers do not lie as on a board of " + std::to_string(board.getChessboardSize().width) +
           "x" + std::to_string(board.getChessboardSize().height) + " squares";
  if (sides.empty()) return {};
  std::nth_element(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(sides.size() / 2), sides.end());
  const double measured = sides[sides.size() / 2] / board.getSquareLength();
  const double described = static_cast<double>(board.getMarkerLength()) / board.getSquareLength();
  if (std::abs(measured / described - 1.0) <= kMarkerTolerance) return {};
  const auto percent = [](double share) { return std::to_string(std::lround(100.0 * share)) + " %"; };
  return "its markers measure " + percent(measured) + " of a square, by the description " +
         percent(described) + ": the square or the marker size is wrong";
}

std::optional<BoardSighting> find_charuco_in(const cv::Mat& grey, const Board& board, std::string& why) {
  const Markers markers = find_markers(grey, board.dictionary);
  if (markers.ids.empty()) {
    why = "no marker of " + board.dictionary + " is seen";
    return std::nullopt;
  }
  const auto charuco = charuco_board(board);
  const int count = static_cast<int>(charuco->ids.size());
  for (const int id : markers.ids) {
    if (id < count || markers.ids.size() < 4) continue;
    why = "marker " + std::to_string(id) + " is seen, a board of " + std::to_string(board.columns) + "x" +
          std::to_string(board.rows) + " squares has 0 to " + std::to_string(count - 1);
    return std::nullopt;
  }
  Corners corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, grey, charuco, corners, ids);
  if (ids.size() < kFewestCorners) {
    why = "only " + std::to_string(ids.size()) + " corners are seen, at least " +
          std::to_string(kFewestCorners) + " are needed";
    return std::nullopt;
  }
  // Again, because OpenCV 4.6 gives them half a pixel off its own convention.
  refine(grey, charuco_window(board, corners), corners);
  const auto plane = plane_from_picture(*charuco, corners, ids);
  why = plane ? contradiction(*charuco, markers, grey, *plane) : "the corners that are seen lie in one line";
  if (!why.empty()) return std::nullopt;
  // Versions of OpenCV before 4.6 count corners from the bottom left, upwards, later ones from the top left.
  const auto& marker = charuco->objPoints.front();
  const bool upwards = marker[0].y > marker[3].y;
  const int columns = board.corner_columns();
  for (int& id : ids) {
    if (upwards) id = (board.corner_rows() - 1 - id / columns) * columns + id % columns;
  }
  return sighting_of(corners, ids);
}

std::string suspect_chessboard(const cv::Mat& grey, const Board& board) {
  // Asked for the smallest board and allowed to be larger, the detector says how large it is.
  Corners corners;
  cv::Mat cells;
  if (!cv::findChessboardCornersSB(
          grey, {3, 3}, corners, cv::CALIB_CB_LARGER | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE,
          cells))
    return {};
  const int columns = std::max(cells.cols, cells.rows);
  const int rows = std::min(cells.cols, cells.rows);
  if (columns < kFewestColumns) return {};
  if (columns == std::max(board.columns, board.rows) && rows == std::min(board.columns, board.rows))
    return {};
  return "a chessboard of " + std::to_string(columns) + "x" + std::to_string(rows) +
         " inner corners is seen; corners count where four squares meet, not squares";
}

std::string suspect_charuco(const cv::Mat& grey, const Board& board) {
  constexpr std::size_t kEnough = 4;
  cv::Mat mirrored;
  cv::flip(grey, mirrored, 1);
  if (find_markers(mirrored, board.dictionary).ids.size() >= kEnough)
    return "the picture is mirrored: its markers read only the other way round";
  for (const std::string& name : dictionary_names()) {
    if (name != board.dictionary && find_markers(grey, name).ids.size() >= kEnough)
      return "markers of the dictionary " + name + " are seen, not of " + board.dictionary;
  }
  return {};
}

}  // namespace

std::optional<BoardSighting> find_board(const cv::Mat& image, const Board& board, std::string& why) {
  why.clear();
  const cv::Mat grey = grey_of(image);
  return board.kind == BoardKind::chessboard ? find_chessboard_in(grey, board, why)
                                             : find_charuco_in(grey, board, why);
}

std::string suspect_board(const cv::Mat& image, const Board& board) {
  const cv::Mat grey = grey_of(image);
  return board.kind == BoardKind::chessboard ? suspect_chessboard(grey, board) : suspect_charuco(grey, board);
}

}  // namespace skylight::calibration
