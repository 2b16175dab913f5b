// Calibration boards: what they are, and where their corners are in a picture.
//
// A board's frame: origin in its middle, x to the right, y up, z out of the print. A ChArUco board is upright
// as it was drawn; a chessboard where its bottom-left square is dark: one with one odd and one even count of
// corners has one such place, others two, half a turn apart.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "tracker/types.hpp"

namespace skylight::calibration {

enum class BoardKind : std::uint8_t { chessboard, charuco };

struct Board {
  BoardKind kind = BoardKind::chessboard;
  int columns = 9;         ///< chessboard: inner corners; charuco: squares; 2 to 100
  int rows = 6;            ///< the same
  double square_m = 0.03;  ///< edge of a square, 0.001 to 10
  double marker_m = 0.0;   ///< charuco: edge of a marker, smaller than a square
  std::string dictionary;  ///< charuco: as in dictionary_names()

  int corner_columns() const { return kind == BoardKind::chessboard ? columns : columns - 1; }
  int corner_rows() const { return kind == BoardKind::chessboard ? rows : rows - 1; }
  /// Whether turning it by half a turn shows, so that its yaw can be told.
  bool has_one_place() const { return kind == BoardKind::charuco || (columns + rows) % 2 == 1; }
};

/// `chessboard:9x6:0.025` (inner corners, metres), `charuco:8x6:0.04:0.03:4x4_50` (squares, square, marker,
/// dictionary). Throws std::invalid_argument saying what is wrong and what is allowed.
Board parse_board(const std::string& text);
std::string to_string(const Board& board);

/// Of markers: 4x4_50 ... 7x7_1000, original, apriltag_16h5, apriltag_25h9, apriltag_36h10, apriltag_36h11.
std::vector<std::string> dictionary_names();

/// The inner corners in the board's frame, row by row from the top, from left to right; z = 0.
std::vector<Eigen::Vector3d> board_points(const Board& board);

/// Some or all of a board's corners in a picture.
struct BoardSighting {
  std::vector<int> corners;  ///< indices into board_points()
  std::vector<Pixel> pixels;
};

/// The board in a picture (CV_8UC1 or CV_8UC3): a chessboard with all its corners, of a ChArUco board those
/// that are seen, at least 6 and not in one line. None, with `why` filled, where it is not there or
/// contradicts its description.
std::optional<BoardSighting> find_board(const cv::Mat& image, const Board& board, std::string& why);

/// What may be wrong with the board's description, for a picture in which it was not found: another count of
/// squares, another dictionary, a mirrored picture. Slow. Empty where nothing is recognised.
std::string suspect_board(const cv::Mat& image, const Board& board);

}  // namespace skylight::calibration
