#include "service/calibration/sheets.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

namespace skylight::service {
namespace {

using calibration::FloorPlace;
using calibration::SeeingCamera;
using settings::Fields;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
/// Of corners that are found in pictures, to begin with; the residuals say what it is.
constexpr double kTagSigmaPx = 0.15;
constexpr double kBoardSigmaPx = 0.1;
constexpr const char* kPointsSheet = "points";

std::string name_of(const SheetTag& tag) {
  return "tag " + tag.family + ":" + std::to_string(tag.id);
}

calibration::Board upright_board(const std::string& text) {
  calibration::Board board = calibration::parse_board(text);
  if (!board.has_one_place())
    throw std::invalid_argument("board \"" + text +
                                "\" looks the same turned by half a turn, so that its place tells no yaw: "
                                "use one with one odd and one even count of corners, or a ChArUco board");
  return board;
}

/// What of the floor no camera sees, as the end of a sentence; of much, the first few.
std::string unseen(const calibration::ExtrinsicsInput& input) {
  constexpr int kNamed = 5;
  std::string words;
  int count = 0;
  for (std::size_t sheet = 1; sheet < input.sheets.size(); ++sheet) {
    const bool seen = std::any_of(input.cameras.begin(), input.cameras.end(), [&](const auto& camera) {
      return std::any_of(camera.points.begin(), camera.points.end(),
                         [&](const auto& point) { return point.sheet == sheet; });
    });
    if (seen || ++count > kNamed) continue;
    words += (words.empty() ? "; not seen: " : ", ") + input.sheets[sheet].name;
  }
  if (count > kNamed) words += " and " + std::to_string(count - kNamed) + " more";
  return words;
}

FloorPlace floor_place(const SheetPlace& place) {
  return {place.x_m, place.y_m, place.yaw_deg * kRadPerDeg};
}

}  // namespace

void describe(Fields& fields, SheetTag& tag) {
  fields.about("A tag on the floor: where its middle lies, and where its right side points.");
  fields.field("family", tag.family,
               {.help = "36h11, 25h9, 16h5, or a dictionary of ArUco markers as 4x4_50."});
  fields.field("id", tag.id, {.min = 0, .max = 100000, .required = true});
  fields.field("x_m", tag.x_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("y_m", tag.y_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("yaw_deg", tag.yaw_deg, {.min = -360, .max = 360, .unit = "deg"});
  fields.field(
      "size_m", tag.size_m,
      {.min = 0.005, .max = 10, .unit = "m", .required = true, .help = "Outer edge of the black border."});
}

void describe(Fields& fields, SheetPlace& place) {
  fields.about("Where the sheet lies in map, and how well that was measured.");
  fields.field("x_m", place.x_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("y_m", place.y_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("yaw_deg", place.yaw_deg, {.min = -360, .max = 360, .unit = "deg"});
  fields.field("sigma_m", place.sigma_m, {.min = 0, .max = 1, .unit = "m"});
  fields.field("sigma_deg", place.sigma_deg, {.min = 0, .max = 57, .unit = "deg"});
}

void describe(Fields& fields, FloorSheet& sheet) {
  fields.about("What lies on the floor as one piece.");
  fields.field("name", sheet.name, {.min_length = 1, .max_length = 100, .required = true});
  fields.field("place", sheet.place, {.help = "Absent: not measured, the cameras find it out."});
  fields.field("tags", sheet.tags, {.max_items = 1000, .help = "Their places are the sheet's own."});
  fields.field("board", sheet.board, {.help = "A board, its middle the origin, as chessboard:9x6:0.025."});
  fields.check(!sheet.tags.empty() || sheet.board, "tags", "is empty, and there is no board");
}

Floor::Floor(const FloorDescription& description) {
  add({.name = kPointsSheet, .place = FloorPlace{}}, {});
  for (SheetTag tag : description.tags) {
    // Each lies for itself: a tag that was laid down with so much care is turned by as much over its half.
    calibration::Sheet sheet{.name = name_of(tag),
                             .place = FloorPlace{tag.x_m, tag.y_m, tag.yaw_deg * kRadPerDeg},
                             .sigma_m = description.place_sigma_m,
                             .sigma_rad = std::min(1.0, description.place_sigma_m / (0.5 * tag.size_m))};
    tag.x_m = tag.y_m = tag.yaw_deg = 0.0;
    Contents contents;
    add_tag(contents, tag);
    add(std::move(sheet), std::move(contents));
  }
  for (const FloorSheet& described : description.sheets) {
    calibration::Sheet sheet{.name = "sheet " + described.name};
    if (described.place) {
      sheet.place = floor_place(*described.place);
      sheet.sigma_m = described.place->sigma_m;
      sheet.sigma_rad = described.place->sigma_deg * kRadPerDeg;
    }
    Contents contents;
    for (const SheetTag& tag : described.tags) add_tag(contents, tag);
    if (described.board) contents.board = upright_board(*described.board);
    add(std::move(sheet), std::move(contents));
  }
  if (description.board)
    add({.name = "board", .place = floor_place(description.board->at)},
        {.tags = {}, .board = upright_board(description.board->board)});
}

void Floor::add(calibration::Sheet sheet, Contents contents) {
  sheets_.push_back(std::move(sheet));
  contents_.push_back(std::move(contents));
}

void Floor::add_tag(Contents& contents, const SheetTag& tag) const {
  const std::pair key(calibration::tag_dictionary(tag.family), tag.id);
  const bool elsewhere = std::any_of(contents_.begin(), contents_.end(),
                                     [&](const Contents& other) { return other.tags.contains(key); });
  if (elsewhere || !contents.tags.emplace(key, tag).second)
    throw std::invalid_argument(name_of(tag) + " is named twice");
}

std::vector<std::string> Floor::look(const std::string& name, const cv::Mat& picture, SeeingCamera& camera) {
  const CameraModel lens(camera.intrinsics, Eigen::Isometry3d::Identity());
  std::map<std::string, std::vector<calibration::TagSighting>> seen;
  std::vector<std::string> notes;
  for (std::size_t sheet = 0; sheet < sheets_.size(); ++sheet) {
    for (const auto& [key, tag] : contents_[sheet].tags) {
      if (!seen.contains(key.first)) seen[key.first] = calibration::find_tags(picture, key.first, lens);
      for (const auto& sighting : seen[key.first]) {
        if (sighting.id == key.second) add_tag_points(sheet, tag, sighting, camera);
      }
    }
    if (!contents_[sheet].board) continue;
    std::string why = add_board_points(name, sheet, picture, camera);
    if (!why.empty()) notes.push_back(std::move(why));
  }
  return notes;
}

void Floor::add_tag_points(std::size_t sheet, const SheetTag& tag, const calibration::TagSighting& seen,
                           SeeingCamera& camera) {
  const auto corners = calibration::tag_points(tag.size_m);
  const Eigen::Rotation2Dd turn(tag.yaw_deg * kRadPerDeg);
  constexpr std::array kNames{"top left", "top right", "bottom right", "bottom left"};
  ++group_;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d at = Eigen::Vector2d(tag.x_m, tag.y_m) + turn * corners[i];
    camera.points.push_back({.name = name_of(tag) + ", " + kNames[i],
                             .sheet = sheet,
                             .at = {at.x(), at.y(), 0.0},
                             .pixel = seen.corners[i],
                             .sigma_px = kTagSigmaPx,
                             .group = group_});
  }
}

/// Empty, or why the board is not found.
std::string Floor::add_board_points(const std::string& name, std::size_t sheet, const cv::Mat& picture,
                                    SeeingCamera& camera) {
  std::string why;
  const calibration::Board& board = *contents_[sheet].board;
  const auto seen = calibration::find_board(picture, board, why);
  if (!seen) return name + ": " + to_string(board) + " is not found: " + why;
  const auto points = calibration::board_points(board);
  ++group_;
  for (std::size_t i = 0; i < seen->corners.size(); ++i)
    camera.points.push_back({.name = "board, corner " + std::to_string(seen->corners[i] + 1),
                             .sheet = sheet,
                             .at = points[static_cast<std::size_t>(seen->corners[i])],
                             .pixel = seen->pixels[i],
                             .sigma_px = kBoardSigmaPx,
                             .group = group_});
  return {};
}

calibration::ExtrinsicsResult calibrate_on(const Floor& floor, std::vector<SeeingCamera> cameras) {
  const calibration::ExtrinsicsInput input{.sheets = floor.sheets(), .cameras = std::move(cameras)};
  try {
    auto result = calibration::calibrate_extrinsics(input);
    std::erase(result.warnings, std::string(kPointsSheet) + " is seen by no camera");
    return result;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(error.what() + unseen(input));
  }
}

}  // namespace skylight::service
