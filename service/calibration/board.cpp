#include "service/calibration/board.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace skylight::calibration {
namespace {

constexpr int kMostSquares = 100;
constexpr std::string_view kForms =
    "a board is written chessboard:COLUMNSxROWS:SQUARE (inner corners, metres), as chessboard:9x6:0.025, or "
    "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY (squares, metres), as charuco:8x6:0.04:0.03:4x4_50";

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, ':');) parts.push_back(part);
  return parts;
}

template <class T>
bool read_number(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw std::invalid_argument("board \"" + text + "\": " + why);
}

void read_counts(const std::string& text, const std::string& part, Board& board) {
  const std::size_t x = part.find('x');
  const int least = board.kind == BoardKind::chessboard ? 3 : 2;
  if (x == std::string::npos || !read_number(std::string_view(part).substr(0, x), board.columns) ||
      !read_number(std::string_view(part).substr(x + 1), board.rows)) {
    refuse(text, "\"" + part + "\" is no count such as 9x6");
  }
  for (const int count : {board.columns, board.rows}) {
    if (count < least || count > kMostSquares)
      refuse(text, std::to_string(count) + " is out of range, allowed " + std::to_string(least) + " to " +
                       std::to_string(kMostSquares));
  }
}

double read_length(const std::string& text, const std::string& part, const char* what) {
  double value = 0.0;
  if (!read_number(std::string_view(part), value) || !(value >= 0.001 && value <= 10.0))
    refuse(text, std::string(what) + " \"" + part + "\" must be metres, allowed 0.001 to 10");
  return value;
}

}  // namespace

Board parse_board(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  Board board;
  if (!parts.empty() && parts[0] == "charuco") board.kind = BoardKind::charuco;
  const std::size_t wanted = board.kind == BoardKind::chessboard ? 3 : 5;
  if (parts.size() != wanted || (parts[0] != "chessboard" && parts[0] != "charuco"))
    refuse(text, std::string(kForms));
  read_counts(text, parts[1], board);
  board.square_m = read_length(text, parts[2], "the square");
  if (board.kind == BoardKind::chessboard) return board;
  board.marker_m = read_length(text, parts[3], "the marker");
  board.dictionary = parts[4];
  if (!(board.marker_m < board.square_m)) refuse(text, "the marker must be smaller than the square");
  std::string known;
  for (const std::string& name : dictionary_names()) {
    if (name == board.dictionary) return board;
    known += (known.empty() ? "" : ", ") + name;
  }
  refuse(text, "there is no dictionary \"" + board.dictionary + "\"; there are " + known);
}

std::string to_string(const Board& board) {
  std::ostringstream out;
  out << (board.kind == BoardKind::chessboard ? "chessboard:" : "charuco:") << board.columns << "x"
      << board.rows << ":" << board.square_m;
  if (board.kind == BoardKind::charuco) out << ":" << board.marker_m << ":" << board.dictionary;
  return out.str();
}

std::vector<Eigen::Vector3d> board_points(const Board& board) {
  const int columns = board.corner_columns();
  const int rows = board.corner_rows();
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      points.emplace_back((column - 0.5 * (columns - 1)) * board.square_m,
                          (0.5 * (rows - 1) - row) * board.square_m, 0.0);
    }
  }
  return points;
}

}  // namespace skylight::calibration
