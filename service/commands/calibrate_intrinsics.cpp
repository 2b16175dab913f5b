#include <algorithm>
#include <cstdio>
#include <numbers>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "service/assembly.hpp"
#include "service/calibration/documents.hpp"
#include "service/calibration/guide.hpp"
#include "service/calibration/views.hpp"
#include "service/clock.hpp"
#include "service/commands/calibrate.hpp"
#include "service/sources/video.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using calibration::Board;
using calibration::BoardView;
using Json = nlohmann::ordered_json;

struct IntrinsicsFlags {
  std::vector<std::string> inputs;  ///< empty: a camera of the configuration, live
  ConfigFlags config;
  std::string camera;
  double duration_s = 120.0;
  std::string board;
  std::string lens = "auto";
  std::string out;
  int most_views = 60;
  bool json = false;
};

struct Found {
  std::vector<BoardView> views;
  std::vector<CalibrationSource> without;  ///< pictures that make no view
  cv::Size size;
};

constexpr std::size_t kFewestViews = IntrinsicsGuide::kFewestViews;

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

void look_at_pictures(const IntrinsicsFlags& flags, calibration::ViewCollector& collector, Found& found) {
  Progress progress("looking for the board", 0);
  for (const std::string& input : flags.inputs) {
    for_each_picture(input, [&](const std::string& name, const cv::Mat& picture) {
      const auto looked = collector.look(name, picture);
      if (!looked.taken) found.without.push_back({.name = name, .used = false, .why_not = looked.why_not});
      progress.step();
    });
  }
}

std::size_t camera_index(const Assembly& assembly, const std::string& id) {
  std::string known;
  for (std::size_t i = 0; i < assembly.cameras.size(); ++i) {
    if (assembly.cameras[i].id == id || (id.empty() && assembly.cameras.size() == 1)) return i;
    known += (known.empty() ? "" : ", ") + assembly.cameras[i].id;
  }
  throw UsageError(id.empty() ? "which camera? Give --camera, one of: " + known
                              : "--camera: there is no camera '" + id + "', there are: " + known);
}

// Says why there are no pictures, for as long as this lives.
class Complaints {
 public:
  explicit Complaints(FrameSource& source) : source_(source) {
    source_.watch([this] {
      for (const FeedStatus& feed : source_.feeds()) {
        if (!feed.reason.empty()) std::fprintf(stderr, "%s\n", feed.reason.c_str());
      }
    });
  }
  ~Complaints() { source_.watch({}); }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

 private:
  FrameSource& source_;
};

/// Until nothing is missing, or the time is up. Says what it took and what is missing.
void look_at_camera(const IntrinsicsFlags& flags, calibration::ViewCollector& collector) {
  if (flags.config.file.empty() && flags.config.sets.empty())
    throw UsageError("which pictures? Give some, or a live camera's --config");
  const Assembly assembly = assemble(flags.config.load());
  if (!assembly.source->live())
    throw UsageError("the configuration's source is no live camera: give its pictures or video by name");
  const std::size_t index = camera_index(assembly, flags.camera);
  if (assembly.source->feeds().at(index).kind == "posted")
    throw UsageError(
        "camera '" + assembly.cameras[index].id +
        "' is posted to a running service: calibrate it there, with POST .../calibration/intrinsics");
  const Complaints complaints(*assembly.source);
  std::optional<Time> begun;
  std::string said;
  while (const auto frame = assembly.source->next()) {
    if (frame->camera != index) continue;
    if (!begun) begun = frame->captured;
    if (to_seconds(frame->captured - *begun) > flags.duration_s) return;
    const std::size_t count = collector.views().size();
    const auto looked = collector.look("view " + std::to_string(count + 1), frame->image, frame->captured);
    if (looked.taken) {
      const auto missing = calibration::missing_views(
          calibration::coverage_of(collector.views(), assembly.cameras[index].model.intrinsics()));
      if (missing.empty() && count + 1 >= IntrinsicsGuide::kGoodViews) return;
      std::fprintf(stderr, "view %zu taken; %s\n", count + 1, missing.empty() ? "more" : missing[0].c_str());
    } else if (looked.why_not != said) {
      std::fprintf(stderr, "%s\n", looked.why_not.c_str());
    }
    said = looked.why_not;
  }
}

Found find_boards(const IntrinsicsFlags& flags, const Board& board) {
  const bool live = flags.inputs.empty();
  calibration::ViewCollector collector(board, live ? calibration::kLiveViews : calibration::CollectOptions{});
  Found found;
  live ? look_at_camera(flags, collector) : look_at_pictures(flags, collector, found);
  found.views = collector.views();
  found.size = collector.size();
  if (found.views.size() < kFewestViews) {
    std::string why = found.without.empty() ? "there are no more pictures" : found.without.front().why_not;
    if (!collector.suspicion().empty()) why += "; " + collector.suspicion();
    throw std::runtime_error("the board " + flags.board + " is in " + std::to_string(found.views.size()) +
                             " pictures, at least " + std::to_string(kFewestViews) +
                             " that differ are needed, 10 to 20 are good: " + why);
  }
  thin(found, flags.most_views);
  return found;
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
  CalibrationFile file;
  set_intrinsics(file, result, found.without, {.made = utc_text(system_now()), .from = to_string(board)});
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
      "corners, tilted to all sides by 15 to 45 degrees, held still. Or film it while it is moved slowly. "
      "Before a live camera hold it still for a second at each place: what is taken and what is missing is "
      "said.\n\n"
      "  skylight calibrate intrinsics pictures/ --board chessboard:9x6:0.025 --out hall.json\n"
      "  skylight calibrate intrinsics --config my.json --camera hall --board chessboard:9x6:0.025 --out "
      "hall.json");
  auto* inputs = command->add_option("inputs", flags->inputs,
                                     "Pictures, folders of pictures, videos; none: a live camera");
  flags->config.add_to(*command);
  command->get_option("--config")->excludes(inputs);
  command->add_option("--camera", flags->camera, "With --config: which camera, where there are several");
  command->add_option("--duration", flags->duration_s, "Seconds before a live camera, at most (120)")
      ->check(CLI::Range(1.0, 3600.0));
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
