#include <algorithm>
#include <cstdio>
#include <numbers>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "service/calibration/board.hpp"
#include "service/commands/calibrate.hpp"
#include "service/sources/video.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using calibration::Board;
using calibration::BoardView;
using Json = nlohmann::ordered_json;

struct IntrinsicsFlags {
  std::vector<std::string> inputs;
  std::string board;
  std::string lens = "auto";
  std::string out;
  int most_views = 60;
  bool json = false;
};

struct Found {
  std::vector<BoardView> views;
  std::vector<CalibrationSource> without;  ///< pictures in which the board was not found
  std::string suspicion;
  cv::Size size;
};

constexpr std::size_t kFewestViews = 3;
constexpr int kSuspects = 3;  ///< pictures that are searched for what is wrong with the board

/// Pictures by name, whatever holds them.
template <class Use>
void for_each_picture(const std::string& input, const Use& use) {
  const fs::path path(input);
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kPictures{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm"};
  if (std::find(kPictures.begin(), kPictures.end(), extension) != kPictures.end()) {
    use(path.filename().string(), read_picture(path, cv::IMREAD_COLOR));
    return;
  }
  std::unique_ptr<FrameSource> source;
  if (fs::is_directory(path)) {
    source = std::make_unique<FolderFrames>(path, FileSourceOptions{.frame_rate_hz = 30.0});
  } else {
    source = std::make_unique<VideoFrames>(path, FileSourceOptions{});
  }
  for (int number = 1; const auto frame = source->next(); ++number)
    use(path.filename().string() + " #" + std::to_string(number), frame->image);
}

/// A video holds the board still for a while: a view much like the one before adds nothing.
bool much_like(const BoardView& a, const BoardView& b, double near_px) {
  if (a.pixels.size() != b.pixels.size() || a.points != b.points) return false;
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += (a.pixels[i] - b.pixels[i]).norm();
  return sum < near_px * static_cast<double>(a.pixels.size());
}

void look_at(const std::string& name, const cv::Mat& picture, const Board& board, Found& found) {
  if (found.size.empty()) found.size = picture.size();
  if (picture.size() != found.size)
    throw std::runtime_error(name + " is " + std::to_string(picture.cols) + " x " +
                             std::to_string(picture.rows) + " px, the pictures before it " +
                             std::to_string(found.size.width) + " x " + std::to_string(found.size.height) +
                             " px: take all with the same settings");
  std::string why;
  const auto seen = calibration::find_board(picture, board, why);
  if (!seen) {
    if (found.suspicion.empty() && std::ssize(found.without) < kSuspects)
      found.suspicion = calibration::suspect_board(picture, board);
    found.without.push_back({.name = name, .used = false, .why_not = why});
    return;
  }
  const auto points = calibration::board_points(board);
  BoardView view{.name = name, .pixels = seen->pixels};
  for (const int corner : seen->corners) view.points.push_back(points[static_cast<std::size_t>(corner)]);
  const double near_px = 0.01 * picture.cols;
  const bool known = std::any_of(found.views.begin(), found.views.end(),
                                 [&](const BoardView& other) { return much_like(view, other, near_px); });
  if (known) {
    found.without.push_back({.name = name, .used = false, .why_not = "much like another picture"});
  } else {
    found.views.push_back(std::move(view));
  }
}

/// Evenly over all of them, so that a long video is not paid for by the square of its length.
void thin(Found& found, int most) {
  const std::size_t count = found.views.size();
  const auto limit = static_cast<std::size_t>(most);
  if (count <= limit) return;
  std::vector<BoardView> kept;
  for (std::size_t i = 0; i < limit; ++i) kept.push_back(found.views[i * count / limit]);
  std::fprintf(stderr, "%zu of %zu views are taken (--most-views)\n", limit, count);
  found.views = std::move(kept);
}

Found find_boards(const IntrinsicsFlags& flags, const Board& board) {
  Found found;
  {
    Progress progress("looking for the board", 0);
    for (const std::string& input : flags.inputs) {
      for_each_picture(input, [&](const std::string& name, const cv::Mat& picture) {
        look_at(name, picture, board, found);
        progress.step();
      });
    }
  }
  if (found.views.size() < kFewestViews) {
    std::string why = found.without.empty() ? "there are no more pictures" : found.without.front().why_not;
    if (!found.suspicion.empty()) why += "; " + found.suspicion;
    throw std::runtime_error("the board " + flags.board + " is in " + std::to_string(found.views.size()) +
                             " pictures, at least " + std::to_string(kFewestViews) +
                             " that differ are needed, 10 to 20 are good: " + why);
  }
  thin(found, flags.most_views);
  return found;
}

CalibrationFile file_of(const calibration::IntrinsicsResult& result, const Found& found,
                        const std::string& board) {
  CalibrationFile file;
  file.intrinsics = result.intrinsics;
  CameraUncertainty uncertainty;
  uncertainty.covariance.topLeftCorner<kCameraPosition, kCameraPosition>() = result.covariance;
  set_uncertainty(file, uncertainty);
  CalibrationStep& step = file.intrinsics_made.emplace(
      CalibrationStep{.made = utc_now(), .from = board, .rms_px = result.rms_px});
  for (const calibration::ViewResult& view : result.views)
    step.sources.push_back(
        {.name = view.name, .used = view.used, .why_not = view.why_not, .error_px = view.rms_px});
  step.sources.insert(step.sources.end(), found.without.begin(), found.without.end());
  return file;
}

void print(const calibration::IntrinsicsResult& result, const Found& found) {
  const Intrinsics& in = result.intrinsics;
  const auto sigma = [&](int i) { return std::sqrt(result.covariance(i, i)); };
  std::printf("%-24s %8s %6s %s\n", "picture", "error px", "tilt", "");
  for (const calibration::ViewResult& view : result.views) {
    std::printf("%-24s %8.3f %5.0f° %s%s\n", view.name.c_str(), view.rms_px,
                view.tilt_rad * 180.0 / std::numbers::pi, view.used ? "" : "dropped: ", view.why_not.c_str());
    if (view.points_left_out > 0) std::printf("%-24s %d corners left out\n", "", view.points_left_out);
  }
  for (const CalibrationSource& source : found.without)
    std::printf("%-24s %8s %6s not used: %s\n", source.name.c_str(), "", "", source.why_not.c_str());
  std::printf("\ncorners over the picture (. none, + few, # many)\n");
  for (const std::string& line : coverage_map(result.coverage)) std::printf("  %s\n", line.c_str());
  std::printf("\n%s, %d x %d px, reprojection error %.3f px RMS\n",
              in.lens == LensModel::brown_conrady ? "pinhole (brown_conrady)" : "fisheye (kannala_brandt)",
              in.width_px, in.height_px, result.rms_px);
  if (!result.lens_reason.empty()) std::printf("  %s\n", result.lens_reason.c_str());
  std::printf("  fx %.3f ± %.3f px, fy %.3f ± %.3f px\n", in.fx_px, sigma(kFocalX), in.fy_px, sigma(kFocalY));
  std::printf("  cx %.3f ± %.3f px, cy %.3f ± %.3f px\n", in.cx_px, sigma(kCentreX), in.cy_px,
              sigma(kCentreY));
  std::printf("  distortion");
  for (int i = 0; i < 5; ++i)
    std::printf(" %.6f ± %.6f", in.distortion[static_cast<std::size_t>(i)], sigma(kDistortion + i));
  std::printf("\n");
  for (const std::string& warning : result.warnings) std::printf("note: %s\n", warning.c_str());
}

int calibrate(const IntrinsicsFlags& flags) {
  Board board;
  try {
    board = calibration::parse_board(flags.board);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--board: ") + error.what());
  }
  const Found found = find_boards(flags, board);
  calibration::IntrinsicsOptions options{.width_px = found.size.width, .height_px = found.size.height};
  if (flags.lens != "auto")
    options.lens = flags.lens == "pinhole" ? LensModel::brown_conrady : LensModel::kannala_brandt;
  const auto result = calibration::calibrate_intrinsics(found.views, options);
  const CalibrationFile file = file_of(result, found, to_string(board));
  if (flags.json) {
    Json out = Json::parse(calibration_json(file));
    out["coverage"] = coverage_map(result.coverage);
    out["lens_reason"] = result.lens_reason;
    out["warnings"] = result.warnings;
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    print(result, found);
  }
  if (!flags.out.empty()) save(flags.out, file);
  return 0;
}

}  // namespace

void add_calibrate_intrinsics(CLI::App& calibrate_command, Run& run) {
  auto flags = std::make_shared<IntrinsicsFlags>();
  CLI::App* command = calibrate_command.add_subcommand(
      "intrinsics",
      "Lens and sensor of a camera from pictures of a board.\n\n"
      "Print a board, glue it to something flat, measure a square. Take 10 to 20 pictures with the camera as "
      "it will "
      "be used (same size, focus and zoom): the board near enough to fill a third of the picture, in all of "
      "its "
      "corners, tilted to all sides by 15 to 45 degrees, held still. Or film it while it is moved slowly.\n\n"
      "  skylight calibrate intrinsics pictures/ --board chessboard:9x6:0.025 --out hall.json");
  command->add_option("inputs", flags->inputs, "Pictures, folders of pictures, videos")->required();
  command
      ->add_option("--board", flags->board,
                   "chessboard:COLUMNSxROWS:SQUARE, counting inner corners, or "
                   "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY, counting squares; sizes in metres, as "
                   "chessboard:9x6:0.025 or charuco:8x6:0.04:0.03:4x4_50")
      ->required();
  command->add_option("--lens", flags->lens, "pinhole, fisheye, or auto: whichever fits (auto)")
      ->check(CLI::IsMember({"pinhole", "fisheye", "auto"}));
  command->add_option("--out", flags->out, "Calibration file to write; what was there is kept as a version");
  command->add_option("--most-views", flags->most_views, "Views that are taken of a long video (60)")
      ->check(CLI::Range(3, 500));
  command->add_flag("--json", flags->json, "The result as JSON");
  command->callback([flags, &run] { run = [flags] { return calibrate(*flags); }; });
}

}  // namespace skylight::service
