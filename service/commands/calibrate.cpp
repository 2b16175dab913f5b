#include "service/commands/calibrate.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

#include <opencv2/imgcodecs.hpp>

#include "service/calibration/map_frame.hpp"
#include "service/calibration/tags.hpp"
#include "service/sources/video.hpp"
#include "settings/fields.hpp"

namespace skylight::service {

using settings::Fields;

namespace {

struct SheetList {
  std::vector<FloorSheet> sheets{};
};
void describe(Fields& fields, SheetList& list) {
  fields.field("sheets", list.sheets, {.min_items = 1, .required = true});
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  for (const char c : line + ',') {
    if (c == ',' || c == ';') {
      cells.push_back(cell);
      cell.clear();
    } else if (c != ' ' && c != '\t' && c != '\r') {
      cell += c;
    }
  }
  return cells;
}

bool read_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace

std::vector<double> numbers_of(const std::string& text, std::size_t count, const std::string& option,
                               const std::string& form) {
  std::vector<double> out;
  for (const std::string& cell : cells_of(text)) {
    double value = 0.0;
    if (!read_number(cell, value)) throw UsageError(option + ": \"" + text + "\" is no " + form);
    out.push_back(value);
  }
  if (out.size() != count) throw UsageError(option + ": \"" + text + "\" is no " + form);
  return out;
}

int tag_id(double id, const std::string& text) {
  if (id >= 0.0 && id <= 100000.0 && id == std::floor(id)) return static_cast<int>(id);
  throw UsageError("--tag: \"" + text + "\": the tag's id must be a whole number, allowed 0 to 100000");
}

void save(const std::filesystem::path& file, const CalibrationFile& calibration) {
  const auto kept = write_calibration(file, calibration);
  std::fprintf(stderr, "written: %s%s\n", file.c_str(),
               kept ? (" (what was there is kept as " + kept->file.string() + ")").c_str() : "");
}

void check_size(const CalibrationFile& calibration, const std::string& file, const cv::Mat& picture,
                const std::string& picture_name) {
  const Intrinsics& in = calibration.intrinsics;
  if (picture.cols == in.width_px && picture.rows == in.height_px) return;
  throw std::runtime_error(picture_name + " is " + std::to_string(picture.cols) + " x " +
                           std::to_string(picture.rows) + " px, " + file + " is of a camera with " +
                           std::to_string(in.width_px) + " x " + std::to_string(in.height_px) + " px");
}

std::vector<FloorSheet> read_sheets(const std::filesystem::path& file) {
  return settings::read<SheetList>(settings::load(file)).sheets;
}

CsvFile::CsvFile(const std::filesystem::path& file) : name_(file.string()) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(name_ + ": cannot be read");
  std::string line;
  std::getline(in, line);
  heading_ = cells_of(line);
  for (int number = 2; std::getline(in, line); ++number) {
    std::vector<std::string> cells = cells_of(line);
    if (cells.size() == 1 && cells[0].empty()) continue;
    rows_.push_back({number, std::move(cells)});
  }
}

std::optional<std::size_t> CsvFile::find_column(const std::string& name) const {
  const auto at = std::find(heading_.begin(), heading_.end(), name);
  if (at == heading_.end()) return std::nullopt;
  return static_cast<std::size_t>(at - heading_.begin());
}

std::size_t CsvFile::column(const std::string& name) const {
  if (const auto at = find_column(name)) return *at;
  throw std::runtime_error(name_ + ":1: there is no column " + name);
}

const std::string& CsvFile::text(std::size_t row, std::size_t column) const {
  static const std::string kNothing;
  const Row& there = rows_[row];
  return column < there.cells.size() ? there.cells[column] : kNothing;
}

double CsvFile::number(std::size_t row, std::size_t column) const {
  double value = 0.0;
  if (read_number(text(row, column), value)) return value;
  throw std::runtime_error(name_ + ":" + std::to_string(line(row)) + ": " + heading_[column] +
                           " is no number");
}

std::vector<calibration::SeenPoint> read_points(const std::filesystem::path& path) {
  const CsvFile file(path);
  for (const char* wanted : {"u_px", "v_px", "x_m", "y_m"}) {
    if (!file.find_column(wanted))
      throw std::runtime_error(path.string() + ":1: there is no column " + wanted +
                               "; wanted are u_px, v_px, x_m, y_m and, if you like, z_m and name");
  }
  const auto height = file.find_column("z_m");
  const auto name = file.find_column("name");
  std::vector<calibration::SeenPoint> points;
  for (std::size_t row = 0; row < file.rows(); ++row) {
    const auto number = [&](const char* column) { return file.number(row, file.column(column)); };
    const std::string place = path.filename().string() + ":" + std::to_string(file.line(row));
    points.push_back({.name = name && !file.text(row, *name).empty() ? file.text(row, *name) : place,
                      .at = {number("x_m"), number("y_m"), height ? file.number(row, *height) : 0.0},
                      .pixel = {number("u_px"), number("v_px")}});
  }
  return points;
}

namespace {

struct RestoreFlags {
  std::string file;
  std::optional<int> version;
  bool list = false;
};

int restore(const RestoreFlags& flags) {
  if (!flags.list) {
    const int number = restore_calibration(flags.file, flags.version);
    std::fprintf(stderr, "%s is version %d again; what was there is kept\n", flags.file.c_str(), number);
    return 0;
  }
  for (const CalibrationVersion& version : calibration_versions(flags.file)) {
    std::string told;
    try {
      const CalibrationFile file = read_calibration(version.file);
      const auto& step = file.extrinsics_made ? file.extrinsics_made : file.intrinsics_made;
      told = step ? step->made : "";
    } catch (const settings::Error& error) {  // of somebody who edited it
      told = std::string("is no calibration: ") + error.what();
    }
    std::printf("%d\t%s\t%s\n", version.number, version.file.c_str(), told.c_str());
  }
  return 0;
}

struct MapFlags {
  std::vector<std::string> files;
  std::string frame;
  std::string points;
  std::string tag;
};

calibration::FloorPlace frame_by_points(const MapFlags& flags, const CameraModel& camera) {
  const auto n = numbers_of(flags.points, 4, "--points", "two pixels U,V,U,V");
  const auto origin = camera.plane_from_pixel({n[0], n[1]}, 0.0);
  const auto along = camera.plane_from_pixel({n[2], n[3]}, 0.0);
  if (!origin || !along) throw std::runtime_error("--points: the camera does not see the floor there");
  return calibration::frame_of(*origin, *along);
}

calibration::FloorPlace frame_by_tag(const MapFlags& flags, const CameraModel& camera) {
  const std::size_t colon = flags.tag.find(':');
  const std::size_t equals = flags.tag.find('=');
  double id = 0.0;
  if (colon == std::string::npos || equals == std::string::npos || equals < colon ||
      !read_number(std::string_view(flags.tag).substr(colon + 1, equals - colon - 1), id))
    throw UsageError("--tag: \"" + flags.tag + "\" is no FAMILY:ID=PICTURE, as 36h11:0=floor.png");
  const int number = tag_id(id, flags.tag);
  const std::string dictionary = calibration::tag_dictionary(flags.tag.substr(0, colon));
  const std::string picture = flags.tag.substr(equals + 1);
  for (const auto& tag :
       calibration::find_tags(read_picture(picture, cv::IMREAD_COLOR), dictionary, camera)) {
    if (tag.id != number) continue;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    std::array<Eigen::Vector2d, 4> floor;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto at = camera.plane_from_pixel(tag.corners[i], 0.0);
      if (!at) throw std::runtime_error(picture + ": the tag is not on the floor");
      floor[i] = *at;
      middle += 0.25 * *at;
    }
    return calibration::frame_of(middle, middle + 0.5 * (floor[1] + floor[2]) - 0.5 * (floor[0] + floor[3]));
  }
  throw std::runtime_error(picture + ": tag " + flags.tag.substr(0, equals) + " is not seen");
}

int set_map(const MapFlags& flags) {
  if ((flags.frame.empty() ? 0 : 1) + (flags.points.empty() ? 0 : 1) + (flags.tag.empty() ? 0 : 1) != 1)
    throw UsageError("say one of --frame, --points and --tag");
  std::vector<CalibrationFile> files;
  for (const std::string& file : flags.files) {
    files.push_back(read_calibration(file));
    if (!files.back().map_from_camera)
      throw std::runtime_error(file + ": it has no place yet: run skylight calibrate extrinsics");
  }
  calibration::FloorPlace frame;
  if (!flags.frame.empty()) {
    const auto n = numbers_of(flags.frame, 3, "--frame", "place X,Y,YAW (metres, degrees)");
    frame = {n[0], n[1], n[2] * std::numbers::pi / 180.0};
  } else {
    const CameraModel camera = camera_model(files.front());
    frame = flags.points.empty() ? frame_by_tag(flags, camera) : frame_by_points(flags, camera);
  }
  const Eigen::Isometry3d motion = calibration::new_from_old(frame);
  for (std::size_t i = 0; i < files.size(); ++i) {
    files[i].map_from_camera = calibrated_pose(motion * pose_of(*files[i].map_from_camera));
    set_uncertainty(files[i], calibration::turned(uncertainty_of(files[i]), motion));
    save(flags.files[i], files[i]);
  }
  std::printf("the map's origin was (%.4f, %.4f) m, its x axis points to %.3f degrees of the old one\n",
              frame.x_m, frame.y_m, frame.yaw_rad * 180.0 / std::numbers::pi);
  return 0;
}

}  // namespace

void add_calibrate_restore(CLI::App& calibrate, Run& run) {
  auto flags = std::make_shared<RestoreFlags>();
  CLI::App* command = calibrate.add_subcommand(
      "restore",
      "Puts an earlier version of a calibration file back. Every command that writes a file keeps what was "
      "there "
      "as FILE.1.json, FILE.2.json and so on; restoring keeps what is there now in the same way.");
  command->add_option("file", flags->file, "Calibration file")->required();
  command->add_option("--version", flags->version, "Which version; without it the newest one kept");
  command->add_flag("--list", flags->list, "Only list the versions: number, file, when it was made");
  command->callback([flags, &run] { run = [flags] { return restore(*flags); }; });
}

void add_calibrate_map(CLI::App& calibrate, Run& run) {
  auto flags = std::make_shared<MapFlags>();
  CLI::App* command = calibrate.add_subcommand(
      "map",
      "Gives the map another origin and other axes: all cameras of a room are moved together, so name all of "
      "their files. Nothing changes between the cameras.");
  command->add_option("files", flags->files, "Calibration files of all cameras that share the map")
      ->required();
  command->add_option(
      "--frame", flags->frame,
      "The new origin in the present map and where the new x axis points: X,Y,YAW in metres and "
      "degrees");
  command->add_option(
      "--points", flags->points,
      "The same by two pixels of the first file's camera, U,V,U,V: what is seen at the first is "
      "the origin, the second lies on the x axis");
  command->add_option("--tag", flags->tag,
                      "The same by a tag on the floor in a picture of the first file's camera, "
                      "FAMILY:ID=PICTURE: its middle is the origin, its right side points along x");
  command->callback([flags, &run] { run = [flags] { return set_map(*flags); }; });
}

void add_calibrate(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("calibrate",
                                         "Finds out what a camera is and where it hangs, and how well both "
                                         "are known. First `calibrate intrinsics` "
                                         "with pictures of a board, then `calibrate extrinsics` with "
                                         "something at known places on the floor; the file "
                                         "they write goes into the configuration as cameras[].calibration. "
                                         "`calibrate robot` measures a robot that these cameras see.");
  command->require_subcommand(1);
  add_calibrate_intrinsics(*command, run);
  add_calibrate_extrinsics(*command, run);
  add_calibrate_robot(*command, run);
  add_calibrate_map(*command, run);
  add_calibrate_restore(*command, run);
}

}  // namespace skylight::service
