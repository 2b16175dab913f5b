#include <algorithm>
#include <cstdio>
#include <numbers>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "service/calibration/documents.hpp"
#include "service/clock.hpp"
#include "service/commands/calibrate.hpp"
#include "service/sources/video.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using calibration::SeeingCamera;
using calibration::SeenPoint;
using Json = nlohmann::ordered_json;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

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
          .id = tag_id(id[0], text),
          .x_m = place[0],
          .y_m = place[1],
          .yaw_deg = place[2],
          .size_m = size[0]};
}

FloorDescription description_of(const ExtrinsicsFlags& flags) {
  FloorDescription floor{.place_sigma_m = flags.place_sigma_m};
  for (const std::string& text : flags.tags) floor.tags.push_back(tag_of(text));
  for (const std::string& file : flags.sheets) {
    for (FloorSheet& sheet : read_sheets(file)) floor.sheets.push_back(std::move(sheet));
  }
  if (!flags.board.empty()) {
    const auto at = numbers_of(flags.board_at, 3, "--board-at", "place X,Y,YAW (metres, degrees)");
    floor.board = FloorBoard{
        flags.board, {.x_m = at[0], .y_m = at[1], .yaw_deg = at[2], .sigma_m = 0.0, .sigma_deg = 0.0}};
  }
  return floor;
}

Floor floor_of(const ExtrinsicsFlags& flags) {
  try {
    return Floor(description_of(flags));
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

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

/// The lens as it was before an earlier extrinsics calibration refined it.
CalibrationFile lens_of(const fs::path& path) {
  CalibrationFile now = read_calibration(path);
  if (auto earlier = before_extrinsics(now, read_versions(path))) return *earlier;
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
    file = lens_of(argument.file);
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
            Floor& floor, SeeingCamera& camera) {
  for (const std::string& input : argument.inputs) {
    if (fs::path(input).extension() != ".csv") {
      const cv::Mat picture = read_picture(input, cv::IMREAD_COLOR);
      check_size(file, argument.file.string(), picture, input);
      for (const std::string& note : floor.look(input, picture, camera))
        std::fprintf(stderr, "%s\n", note.c_str());
      continue;
    }
    for (SeenPoint point : read_points(input)) {
      point.sigma_px = flags.click_sigma_px;
      point.sigma_m = flags.point_sigma_m;
      camera.points.push_back(std::move(point));
    }
  }
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
  Floor floor = floor_of(flags);
  std::vector<SeeingCamera> cameras;
  std::vector<CameraArgument> arguments;
  std::vector<CalibrationFile> files;
  for (const std::string& text : flags.cameras) {
    arguments.push_back(camera_argument(flags, text));
    SeeingCamera camera{.name = arguments.back().file.string()};
    files.push_back(start_of(flags, arguments.back(), camera));
    camera.height_m = flags.height_m;
    camera.height_sigma_m = flags.height_sigma_m;
    gather(flags, arguments.back(), files.back(), floor, camera);
    cameras.push_back(std::move(camera));
  }
  const auto result = calibrate_on(floor, std::move(cameras));
  Json out{{"cameras", Json::array()}, {"warnings", result.warnings}};
  for (std::size_t i = 0; i < files.size(); ++i) {
    set_extrinsics(files[i], result.cameras[i], {.made = utc_text(system_now()), .from = words_of(flags)});
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
