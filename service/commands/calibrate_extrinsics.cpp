#include <algorithm>
#include <cstdio>
#include <map>
#include <numbers>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/tags.hpp"
#include "service/commands/calibrate.hpp"
#include "service/sources/video.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using calibration::ExtrinsicsInput;
using calibration::FloorPlace;
using calibration::SeeingCamera;
using calibration::SeenPoint;
using Json = nlohmann::ordered_json;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
/// Of corners that are found in pictures, to begin with; the residuals say what it is.
constexpr double kTagSigmaPx = 0.15;
constexpr double kBoardSigmaPx = 0.1;

struct ExtrinsicsFlags {
  std::vector<std::string> cameras;
  std::string points;
  std::vector<std::string> tags;
  std::vector<std::string> sheets;
  std::string board;
  std::string board_at;
  std::string size;
  std::string lens = "pinhole";
  double place_sigma_m = 0.002;
  double click_sigma_px = 1.0;
  double point_sigma_m = 0.0;
  std::optional<double> height_m;
  double height_sigma_m = 0.01;
  bool dry_run = false;
  bool json = false;
};

/// What lies on the floor, by sheet, for the pictures to be searched for.
struct SheetContents {
  std::map<std::pair<std::string, int>, SheetTag> tags;  ///< by dictionary and id
  std::optional<calibration::Board> board;
};

struct Floor {
  std::vector<calibration::Sheet> sheets;
  std::vector<SheetContents> contents;
};

/// --tag FAMILY:ID@X,Y,YAW:SIZE
SheetTag tag_of(const std::string& text) {
  const std::string form = "FAMILY:ID@X,Y,YAW:SIZE, as 36h11:3@1.5,-0.5,90:0.2 (metres, degrees)";
  const auto refuse = [&] { throw UsageError("--tag: \"" + text + "\" is no " + form); };
  const std::size_t colon = text.find(':');
  const std::size_t at = text.find('@');
  const std::size_t last = text.rfind(':');
  if (colon == std::string::npos || at == std::string::npos || at < colon || last < at) refuse();
  const auto id = numbers_of(text.substr(colon + 1, at - colon - 1), 1, "--tag", form);
  const auto place = numbers_of(text.substr(at + 1, last - at - 1), 3, "--tag", form);
  const auto size = numbers_of(text.substr(last + 1), 1, "--tag", form);
  if (!(size[0] >= 0.005 && size[0] <= 10.0))
    throw UsageError("--tag: \"" + text + "\": the size must be metres, allowed 0.005 to 10");
  return {.family = text.substr(0, colon),
          .id = static_cast<int>(id[0]),
          .x_m = place[0],
          .y_m = place[1],
          .yaw_deg = place[2],
          .size_m = size[0]};
}

std::string dictionary_of(const std::string& family) {
  try {
    return calibration::tag_dictionary(family);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

void add_tag(Floor& floor, SheetContents& contents, const SheetTag& tag) {
  const std::pair key(dictionary_of(tag.family), tag.id);
  for (const SheetContents& other : floor.contents) {
    if (other.tags.contains(key))
      throw UsageError("tag " + tag.family + ":" + std::to_string(tag.id) + " is named twice");
  }
  if (!contents.tags.emplace(key, tag).second)
    throw UsageError("tag " + tag.family + ":" + std::to_string(tag.id) + " is named twice");
}

calibration::Board upright_board(const std::string& text) {
  calibration::Board board;
  try {
    board = calibration::parse_board(text);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  if (!board.has_one_place())
    throw UsageError("board \"" + text +
                     "\" looks the same turned by half a turn, so that its place tells no yaw: use "
                     "one with one odd and one even count of corners, or a ChArUco board");
  return board;
}

Floor floor_of(const ExtrinsicsFlags& flags) {
  Floor floor;
  const auto add = [&](calibration::Sheet sheet, SheetContents contents) {
    floor.sheets.push_back(std::move(sheet));
    floor.contents.push_back(std::move(contents));
  };
  add({.name = "points", .place = FloorPlace{}}, {});
  for (const std::string& text : flags.tags) {
    SheetTag tag = tag_of(text);
    // Each lies for itself: a tag that was laid down with so much care is turned by as much over its half.
    calibration::Sheet sheet{.name = "tag " + tag.family + ":" + std::to_string(tag.id),
                             .place = FloorPlace{tag.x_m, tag.y_m, tag.yaw_deg * kRadPerDeg},
                             .sigma_m = flags.place_sigma_m,
                             .sigma_rad = std::min(1.0, flags.place_sigma_m / (0.5 * tag.size_m))};
    tag.x_m = tag.y_m = tag.yaw_deg = 0.0;
    SheetContents contents;
    add_tag(floor, contents, tag);
    add(std::move(sheet), std::move(contents));
  }
  for (const std::string& file : flags.sheets) {
    for (const SheetFile& described : read_sheets(file)) {
      calibration::Sheet sheet{.name = "sheet " + described.name};
      if (described.place) {
        sheet.place =
            FloorPlace{described.place->x_m, described.place->y_m, described.place->yaw_deg * kRadPerDeg};
        sheet.sigma_m = described.place->sigma_m;
        sheet.sigma_rad = described.place->sigma_deg * kRadPerDeg;
      }
      SheetContents contents;
      for (const SheetTag& tag : described.tags) add_tag(floor, contents, tag);
      if (described.board) contents.board = upright_board(*described.board);
      add(std::move(sheet), std::move(contents));
    }
  }
  if (!flags.board.empty()) {
    const auto at = numbers_of(flags.board_at, 3, "--board-at", "place X,Y,YAW (metres, degrees)");
    SheetContents contents{.board = upright_board(flags.board)};
    // The map is where the board lies: that it was laid down askew is nobody's error.
    add({.name = "board", .place = FloorPlace{at[0], at[1], at[2] * kRadPerDeg}}, std::move(contents));
  }
  return floor;
}

class Search {
 public:
  explicit Search(const Floor& floor) : floor_(floor) {}

  /// What of the floor a picture shows.
  void look(const std::string& name, const cv::Mat& picture, SeeingCamera& camera) {
    const CameraModel lens(camera.intrinsics, Eigen::Isometry3d::Identity());
    std::map<std::string, std::vector<calibration::TagSighting>> seen;
    for (std::size_t sheet = 0; sheet < floor_.sheets.size(); ++sheet) {
      for (const auto& [key, tag] : floor_.contents[sheet].tags) {
        if (!seen.contains(key.first)) seen[key.first] = calibration::find_tags(picture, key.first, lens);
        for (const auto& sighting : seen[key.first]) {
          if (sighting.id == key.second) add_tag_points(sheet, tag, sighting, camera);
        }
      }
      if (floor_.contents[sheet].board) add_board_points(name, sheet, picture, camera);
    }
  }

 private:
  void add_tag_points(std::size_t sheet, const SheetTag& tag, const calibration::TagSighting& seen,
                      SeeingCamera& camera) {
    const auto corners = calibration::tag_points(tag.size_m);
    const Eigen::Rotation2Dd turn(tag.yaw_deg * kRadPerDeg);
    constexpr std::array kNames{"top left", "top right", "bottom right", "bottom left"};
    ++group_;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Eigen::Vector2d at = Eigen::Vector2d(tag.x_m, tag.y_m) + turn * corners[i];
      camera.points.push_back({.name = "tag " + tag.family + ":" + std::to_string(tag.id) + ", " + kNames[i],
                               .sheet = sheet,
                               .at = {at.x(), at.y(), 0.0},
                               .pixel = seen.corners[i],
                               .sigma_px = kTagSigmaPx,
                               .group = group_});
    }
  }

  void add_board_points(const std::string& name, std::size_t sheet, const cv::Mat& picture,
                        SeeingCamera& camera) {
    std::string why;
    const calibration::Board& board = *floor_.contents[sheet].board;
    const auto seen = calibration::find_board(picture, board, why);
    if (!seen) {
      std::fprintf(stderr, "%s: %s is not found: %s\n", name.c_str(), to_string(board).c_str(), why.c_str());
      return;
    }
    const auto points = calibration::board_points(board);
    ++group_;
    for (std::size_t i = 0; i < seen->corners.size(); ++i)
      camera.points.push_back({.name = "board, corner " + std::to_string(seen->corners[i] + 1),
                               .sheet = sheet,
                               .at = points[static_cast<std::size_t>(seen->corners[i])],
                               .pixel = seen->pixels[i],
                               .sigma_px = kBoardSigmaPx,
                               .group = group_});
  }

  const Floor& floor_;
  int group_ = 0;
};

/// A camera of the command line: FILE=INPUT,INPUT.
struct CameraArgument {
  fs::path file;
  std::vector<std::string> inputs;
};

CameraArgument camera_argument(const ExtrinsicsFlags& flags, const std::string& text) {
  CameraArgument out;
  const std::size_t equals = text.find('=');
  out.file = text.substr(0, equals);
  if (equals != std::string::npos) {
    std::string input;
    for (const char c : text.substr(equals + 1) + ',') {
      if (c != ',') {
        input += c;
      } else if (!input.empty()) {
        out.inputs.push_back(std::exchange(input, {}));
      }
    }
  }
  if (!flags.points.empty()) out.inputs.push_back(flags.points);
  if (out.inputs.empty())
    throw UsageError("--camera: \"" + text + "\" names no picture and no points, as hall.json=floor.png");
  return out;
}

/// The intrinsics as their own pictures gave them: points of an earlier extrinsics calibration, perhaps the
/// same, are not counted twice.
CalibrationFile before_extrinsics(const fs::path& path, const CalibrationFile& now) {
  if (!now.extrinsics_made) return now;
  for (const CalibrationVersion& version : calibration_versions(path)) {
    const CalibrationFile earlier = read_calibration(version.file);
    if (!earlier.extrinsics_made && earlier.intrinsics_made && now.intrinsics_made &&
        earlier.intrinsics_made->made == now.intrinsics_made->made)
      return earlier;
  }
  std::fprintf(
      stderr,
      "%s: its intrinsics were refined by an earlier extrinsics calibration, and no version from before is "
      "kept: the same points given again count twice\n",
      path.c_str());
  return now;
}

/// The calibration that the camera starts from: its file, or with --size nothing but a size.
CalibrationFile start_of(const ExtrinsicsFlags& flags, const CameraArgument& argument, SeeingCamera& camera) {
  CalibrationFile file;
  if (flags.size.empty()) {
    file = before_extrinsics(argument.file, read_calibration(argument.file));
    camera.covariance = uncertainty_of(file).covariance.topLeftCorner<kCameraPosition, kCameraPosition>();
  } else {
    const std::size_t x = flags.size.find('x');
    const std::string both =
        x == std::string::npos ? flags.size : flags.size.substr(0, x) + "," + flags.size.substr(x + 1);
    const auto size = numbers_of(both, 2, "--size", "size such as 1920x1080");
    if (!(size[0] >= 1.0 && size[1] >= 1.0 && size[0] <= Intrinsics::kLargestSide &&
          size[1] <= Intrinsics::kLargestSide))
      throw UsageError("--size: \"" + flags.size + "\" is out of range, allowed 1x1 to 65535x65535");
    const bool pinhole = flags.lens == "pinhole";
    file.intrinsics = {.width_px = static_cast<int>(size[0]),
                       .height_px = static_cast<int>(size[1]),
                       .fx_px = size[0],
                       .fy_px = size[0],
                       .cx_px = (size[0] - 1.0) / 2.0,
                       .cy_px = (size[1] - 1.0) / 2.0,
                       .lens = pinhole ? LensModel::brown_conrady : LensModel::kannala_brandt};
    camera.unknown_intrinsics = true;
  }
  camera.intrinsics = file.intrinsics;
  return file;
}

void gather(const ExtrinsicsFlags& flags, const CameraArgument& argument, const CalibrationFile& file,
            Search& search, SeeingCamera& camera) {
  for (const std::string& input : argument.inputs) {
    if (fs::path(input).extension() != ".csv") {
      const cv::Mat picture = read_picture(input, cv::IMREAD_COLOR);
      check_size(file, argument.file.string(), picture, input);
      search.look(input, picture, camera);
      continue;
    }
    for (SeenPoint point : read_points(input)) {
      point.sigma_px = flags.click_sigma_px;
      point.sigma_m = flags.point_sigma_m;
      camera.points.push_back(std::move(point));
    }
  }
}

void describe_result(const calibration::CameraResult& result, const std::string& from,
                     CalibrationFile& file) {
  file.intrinsics = result.intrinsics;
  file.map_from_camera = calibrated_pose(result.map_from_camera);
  set_uncertainty(file, result.uncertainty);
  CalibrationStep& step = file.extrinsics_made.emplace(
      CalibrationStep{.made = utc_now(), .from = from, .rms_px = result.rms_px, .rms_m = result.rms_m});
  for (const calibration::PointResult& point : result.points)
    step.sources.push_back(
        {.name = point.name,
         .used = point.used,
         .why_not = point.why_not,
         .error_px = std::isfinite(point.residual_px.norm()) ? point.residual_px.norm() : 0.0});
}

void print(const calibration::CameraResult& result) {
  std::printf("%s\n  %-32s %9s %9s %9s\n", result.name.c_str(), "point", "error px", "x mm", "y mm");
  for (const calibration::PointResult& point : result.points)
    std::printf("  %-32s %9.2f %9.1f %9.1f %s%s\n", point.name.c_str(), point.residual_px.norm(),
                1e3 * point.residual_m.x(), 1e3 * point.residual_m.y(),
                point.used ? "" : "left out: ", point.why_not.c_str());
  const auto& t = result.map_from_camera.translation();
  const auto sigma = [&](int i) { return std::sqrt(result.uncertainty.covariance(i, i)); };
  std::printf(
      "  hangs at (%.4f, %.4f, %.4f) ± (%.4f, %.4f, %.4f) m, turned to ± (%.4f, %.4f, %.4f) degrees\n", t.x(),
      t.y(), t.z(), sigma(kCameraPosition), sigma(kCameraPosition + 1), sigma(kCameraPosition + 2),
      sigma(kCameraRotation) / kRadPerDeg, sigma(kCameraRotation + 1) / kRadPerDeg,
      sigma(kCameraRotation + 2) / kRadPerDeg);
  std::printf(
      "  points agree to %.3f px (%.2f mm) RMS; the floor is known to %.2f mm at best, %.2f mm at worst\n",
      result.rms_px, 1e3 * result.rms_m, 1e3 * result.best_floor_sigma_m, 1e3 * result.worst_floor_sigma_m);
}

std::string words_of(const ExtrinsicsFlags& flags) {
  std::string from;
  const auto add = [&](const std::string& what) { from += (from.empty() ? "" : "; ") + what; };
  for (const std::string& tag : flags.tags) add("tag " + tag);
  for (const std::string& sheet : flags.sheets) add("sheets of " + sheet);
  if (!flags.board.empty()) add(flags.board + " at " + flags.board_at);
  if (from.empty()) add("clicked points");
  return from;
}

void check_flags(const ExtrinsicsFlags& flags) {
  if (flags.cameras.size() != 1 && (!flags.points.empty() || flags.height_m))
    throw UsageError(
        "--points and --height are one camera's; with several, points stand behind the camera, as "
        "--camera hall.json=points.csv");
  if (flags.board.empty() != flags.board_at.empty()) throw UsageError("--board and --board-at go together");
  if (!flags.size.empty() && !flags.tags.empty())
    throw UsageError(
        "--size is for a lens that is found from points alone: give tags with a calibrated lens");
}

int calibrate(const ExtrinsicsFlags& flags) {
  check_flags(flags);
  const Floor floor = floor_of(flags);
  ExtrinsicsInput input{.sheets = floor.sheets, .cameras = {}};
  std::vector<CameraArgument> arguments;
  std::vector<CalibrationFile> files;
  Search search(floor);
  for (const std::string& text : flags.cameras) {
    arguments.push_back(camera_argument(flags, text));
    SeeingCamera camera{.name = arguments.back().file.string()};
    files.push_back(start_of(flags, arguments.back(), camera));
    camera.height_m = flags.height_m;
    camera.height_sigma_m = flags.height_sigma_m;
    gather(flags, arguments.back(), files.back(), search, camera);
    input.cameras.push_back(std::move(camera));
  }
  auto result = calibration::calibrate_extrinsics(input);
  std::erase(result.warnings, "points is seen by no camera");
  Json out{{"cameras", Json::array()}, {"warnings", result.warnings}};
  for (std::size_t i = 0; i < files.size(); ++i) {
    describe_result(result.cameras[i], words_of(flags), files[i]);
    if (flags.json) {
      Json& camera = out["cameras"].emplace_back(Json::parse(calibration_json(files[i])));
      camera["file"] = arguments[i].file.string();
      camera["best_floor_sigma_m"] = result.cameras[i].best_floor_sigma_m;
      camera["worst_floor_sigma_m"] = result.cameras[i].worst_floor_sigma_m;
    } else {
      print(result.cameras[i]);
    }
  }
  if (flags.json) {
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    for (const std::string& warning : result.warnings) std::printf("note: %s\n", warning.c_str());
  }
  if (flags.dry_run) return 0;
  for (std::size_t i = 0; i < files.size(); ++i) save(arguments[i].file, files[i]);
  return 0;
}

void add_floor_options(CLI::App& command, ExtrinsicsFlags& flags) {
  command.add_option(
      "--points", flags.points,
      "Clicked points: a CSV file with the heading u_px,v_px,x_m,y_m (and z_m, name if you like); the "
      "same as --camera FILE=points.csv");
  command
      .add_option(
          "--tag", flags.tags,
          "A tag on the floor, FAMILY:ID@X,Y,YAW:SIZE, as 36h11:3@1.5,-0.5,90:0.2: its middle in map, where "
          "its right side points (degrees from x), the outer edge of its black border (metres)")
      ->allow_extra_args(false);
  command
      .add_option(
          "--tags", flags.sheets,
          "Sheets in a JSON file: {\"sheets\": [{\"name\": \"middle\", \"place\": {\"x_m\": 0, \"y_m\": 0, "
          "\"yaw_deg\": 0, \"sigma_m\": 0.002}, \"tags\": [{\"family\": \"36h11\", \"id\": 3, \"x_m\": 0, "
          "\"y_m\": 0, \"size_m\": 0.2}]}]}; without a place the cameras that see it find it out")
      ->allow_extra_args(false);
  command.add_option("--board", flags.board, "A board that lies on the floor, as chessboard:9x6:0.1");
  command.add_option("--board-at", flags.board_at,
                     "Where its middle lies and its x axis points: X,Y,YAW (degrees)");
}

}  // namespace

void add_calibrate_extrinsics(CLI::App& calibrate_command, Run& run) {
  auto flags = std::make_shared<ExtrinsicsFlags>();
  CLI::App* command = calibrate_command.add_subcommand(
      "extrinsics",
      "Where cameras hang, from what lies at known places on the floor: tags, boards, or points that you "
      "click.\n\n"
      "Measure with a tape where tags lie in map (its origin wherever you like, x and y along the room, in "
      "metres), "
      "over the whole floor if it can be; take one picture with each camera.\n\n"
      "  skylight calibrate extrinsics --camera hall.json=floor.png --tag 36h11:0@0,0,0:0.2 --tag "
      "36h11:1@2,1,90:0.2\n\n"
      "Several cameras are calibrated together; a sheet whose place nobody measured joins those that see "
      "it.");
  command
      ->add_option(
          "--camera", flags->cameras,
          "FILE=INPUT,INPUT: a file of skylight calibrate intrinsics, and what its camera sees: pictures, or "
          ".csv files of clicked points. FILE is written anew, its old version kept")
      ->required()
      ->allow_extra_args(false);
  add_floor_options(*command, *flags);
  command->add_option(
      "--size", flags->size,
      "Of the picture, as 1920x1080: the lens too is found from many points, FILE need not exist");
  command->add_option("--lens", flags->lens, "With --size: pinhole or fisheye (pinhole)")
      ->check(CLI::IsMember({"pinhole", "fisheye"}));
  command->add_option("--place-sigma", flags->place_sigma_m, "How well tags' places were measured, m (0.002)")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--point-sigma", flags->point_sigma_m, "The same of clicked points' places, m (0)")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--click-sigma", flags->click_sigma_px, "How well points were clicked, px (1)")
      ->check(CLI::Range(0.01, 100.0));
  command->add_option("--height", flags->height_m, "Of the lens above the floor, where it was measured, m")
      ->check(CLI::Range(0.05, 1000.0));
  command->add_option("--height-sigma", flags->height_sigma_m, "How well, m (0.01)")
      ->check(CLI::Range(1e-4, 10.0));
  command->add_flag("--dry-run", flags->dry_run, "Only say what would be written");
  command->add_flag("--json", flags->json, "The result as JSON");
  command->callback([flags, &run] { run = [flags] { return calibrate(*flags); }; });
}

}  // namespace skylight::service
