#include <cstdio>
#include <fstream>
#include <iostream>

#include "service/assembly.hpp"
#include "service/commands/commands.hpp"
#include "service/mot.hpp"
#include "service/sources/video.hpp"
#include "service/trajectory.hpp"
#include "service/wire.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

struct TrackFlags {
  ConfigFlags config;
  std::string input;
  std::string out;
  std::string kind = "filtered";
  double start_s = 0.0;
  double frame_rate_hz = 0.0;
  double metres_per_pixel = 0.0;
  double camera_height_m = 2.5;
  std::vector<std::string> cuts;
};

struct Cut {
  std::string id;
  double box[4] = {};
  double yaw_deg = 0.0;
};

// ID:X,Y,W,H or ID:X,Y,W,H,YAW_DEG
Cut parse_cut(const std::string& text) {
  Cut cut;
  const auto colon = text.find(':');
  char end = '\0';
  const int fields = colon == std::string::npos
                         ? 0
                         : std::sscanf(text.c_str() + colon + 1, "%lf,%lf,%lf,%lf,%lf%c", &cut.box[0],
                                       &cut.box[1], &cut.box[2], &cut.box[3], &cut.yaw_deg, &end);
  if (fields != 4 && fields != 5)
    throw UsageError("--cut is '" + text +
                     "', expected ID:LEFT,TOP,WIDTH,HEIGHT[,YAW_DEGREES] in pixels of the first frame");
  cut.id = text.substr(0, colon);
  return cut;
}

// A camera that looks straight down and the robots of --cut, as configuration values.
std::vector<Override> camera_and_robots(const TrackFlags& flags, const cv::Size& size) {
  Json camera{{"id", "camera"},
              {"overhead",
               {{"height_m", flags.camera_height_m},
                {"metres_per_pixel", flags.metres_per_pixel},
                {"size_px", {size.width, size.height}}}}};
  Json appearances = Json::array();
  Json robots = Json::array();
  for (const std::string& text : flags.cuts) {
    const Cut cut = parse_cut(text);
    appearances.push_back({{"id", cut.id},
                           {"cut_from_frame",
                            {{"camera", "camera"},
                             {"box_px", cut.box},
                             {"yaw_rad", wrap_angle(cut.yaw_deg * std::numbers::pi / 180.0)}}}});
    robots.push_back({{"id", cut.id}, {"appearance", cut.id}});
  }
  return {{"cameras=" + Json::array({camera}).dump(), "--metres-per-pixel"},
          {"appearances=" + appearances.dump(), "--cut"},
          {"robots=" + robots.dump(), "--cut"}};
}

cv::Size first_frame_size(const TrackFlags& flags) {
  const FileSourceOptions options{.frame_rate_hz = 30.0};
  std::optional<Frame> frame;
  if (fs::is_directory(flags.input)) {
    frame = FolderFrames(flags.input, options).next();
  } else {
    frame = VideoFrames(flags.input, options).next();
  }
  if (!frame) throw SourceError(flags.input + ": no frame");
  return frame->image.size();
}

Config configure(const TrackFlags& flags) {
  std::vector<Override> more;
  std::string camera = "camera";
  if (!fs::is_directory(flags.input) && flags.frame_rate_hz > 0)
    throw UsageError("--frame-rate is for folders of images: a video states its own");
  if (!flags.cuts.empty()) {
    if (!(flags.metres_per_pixel > 0))
      throw UsageError("--cut needs --metres-per-pixel: the scale of the robots' plane");
    if (!flags.config.file.empty())
      throw UsageError("--cut and --config exclude each other: say cut_from_frame in the file");
    more = camera_and_robots(flags, first_frame_size(flags));
  } else if (flags.config.file.empty()) {
    throw UsageError("what is to be tracked? Give --config, or --cut with --metres-per-pixel");
  } else {
    camera.clear();
  }
  const bool folder = fs::is_directory(flags.input);
  Json source{{"type", folder ? "folder" : "video"},
              {"path", fs::absolute(flags.input).string()},
              {"start_s", flags.start_s}};
  if (folder && flags.frame_rate_hz > 0) source["frame_rate_hz"] = flags.frame_rate_hz;
  if (camera.empty()) {
    camera = camera_of_input(flags.config.file, flags.input);
  }
  source["camera"] = camera;
  more.push_back({"source=" + source.dump(), flags.input});
  return flags.config.load(more);
}

struct Tally {
  std::size_t measured = 0;
  std::size_t tracking = 0;
};

struct Outcome {
  std::map<std::string, Tally> robots;
  std::string mot;  ///< lines, where they are wanted
  std::size_t frames = 0;
  std::size_t skipped = 0;
  std::string broken_off;  ///< why the source did; empty where it ended
};

fs::path with_robot(const fs::path& path, const std::string& robot) {
  return path.parent_path() / (path.stem().string() + "." + robot + path.extension().string());
}

void write_file(const fs::path& path, const std::function<void(std::ostream&)>& write) {
  std::ofstream out(path);
  write(out);
  out.flush();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written");
}

void write_results(const fs::path& path, const std::vector<RobotView>& views, PoseKind kind) {
  std::string extension = path.extension().string();
  const auto format = trajectory_format(extension.empty() ? "" : extension.substr(1));
  std::vector<Trajectory> trajectories;
  for (const RobotView& view : views)
    trajectories.push_back(make_trajectory(view, kind, Time::min(), Time::max()));
  if (*format == TrajectoryFormat::csv) {
    write_file(path, [&](std::ostream& out) {
      write_csv_header(out);
      for (const Trajectory& trajectory : trajectories) write_csv_rows(out, trajectory);
    });
    return;
  }
  for (const Trajectory& trajectory : trajectories) {  // these formats hold one robot a file
    write_file(trajectories.size() == 1 ? path : with_robot(path, trajectory.robot),
               [&](std::ostream& out) { write_trajectory(out, trajectory, *format); });
  }
}

bool wants_mot(const TrackFlags& flags) {
  return fs::path(flags.out).extension() == ".mot";
}

void check_out(const TrackFlags& flags) {
  if (flags.out.empty()) return;
  const std::string extension = fs::path(flags.out).extension().string();
  if (!wants_mot(flags) && !trajectory_format(extension.empty() ? "" : extension.substr(1)))
    throw UsageError("--out is '" + flags.out + "', allowed endings: .csv, .tum, .json, .mot");
  // Said now, not after an hour of tracking.
  const fs::path folder = fs::absolute(flags.out).parent_path();
  if (!fs::is_directory(folder)) throw UsageError("--out is '" + flags.out + "': there is no such folder");
  if (fs::is_directory(flags.out)) throw UsageError("--out is '" + flags.out + "', which is a folder");
}

// What was tracked until a source broke off is not lost: the reason waits until it is written out.
std::optional<Frame> next_frame(FrameSource& source, std::string& broken_off) {
  try {
    return source.next();
  } catch (const SourceError& error) {
    broken_off = error.what();
    return std::nullopt;
  }
}

// What a frame told, counted and, if wanted, as lines of a MOTChallenge file.
void take(const TrackFlags& flags, const Frame& frame, const std::vector<RobotReport>& reports,
          const Tracker& tracker, Outcome& outcome) {
  const std::vector<RobotSpec> specs = wants_mot(flags) ? tracker.robots() : std::vector<RobotSpec>{};
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const RobotReport& report = reports[i];
    outcome.robots[report.id].measured += report.measured ? 1 : 0;
    outcome.robots[report.id].tracking += report.state == TrackState::tracking ? 1 : 0;
    if (specs.empty()) continue;
    std::optional<Pose2> pose;
    if (flags.kind == "measured") {
      if (report.measured) pose = report.measured->pose;
    } else if (report.filtered) {
      pose = report.filtered->pose;
    }
    if (pose) outcome.mot += mot_result_line(frame, i, specs[i], *pose, tracker.cameras()[frame.camera]);
  }
}

Outcome track_all(const TrackFlags& flags, FrameSource& source, Tracker& tracker) {
  Outcome outcome;
  Progress progress(flags.input, 0);
  while (const auto frame = next_frame(source, outcome.broken_off)) {
    try {
      take(flags, *frame, tracker.process(*frame), tracker, outcome);
      ++outcome.frames;
    } catch (const std::invalid_argument& e) {
      if (++outcome.skipped == 1)
        std::cerr << "skylight: " << flags.input << ": frame " << frame->sequence << ": " << e.what() << "\n";
    }
    progress.step();
  }
  outcome.skipped += source.bad_frames();
  return outcome;
}

void print(const Outcome& outcome) {
  const std::string skipped =
      outcome.skipped > 0 ? ", " + std::to_string(outcome.skipped) + " skipped" : std::string();
  std::printf("%zu frames%s\n%-20s %10s %10s\n", outcome.frames, skipped.c_str(), "robot", "measured",
              "tracking");
  for (const auto& [robot, tally] : outcome.robots) {
    std::printf("%-20s %9.1f%% %9.1f%%\n", robot.c_str(),
                100.0 * static_cast<double>(tally.measured) / static_cast<double>(outcome.frames),
                100.0 * static_cast<double>(tally.tracking) / static_cast<double>(outcome.frames));
  }
}

int track(const TrackFlags& flags) {
  check_out(flags);
  const PoseKind kind = pose_kind_from_string(flags.kind).value();
  if (wants_mot(flags) && kind == PoseKind::smoothed)
    throw UsageError("--kind is 'smoothed', allowed with a .mot file: measured, filtered");
  Config config = configure(flags);
  config.history.max_age_s = 1e6;  // all of it is written out at the end
  config.history.max_entries = 10'000'000;
  Assembly assembly = assemble(config);
  for (const RobotSpec& robot : assembly.robots) {
    if (kind == PoseKind::smoothed && std::holds_alternative<WindowFilterConfig>(robot.filter))
      throw UsageError("--kind is 'smoothed', but the window filter of robot '" + robot.id +
                       "' has no smoother");
  }
  Tracker tracker = make_tracker(assembly);
  const Outcome outcome = track_all(flags, *assembly.source, tracker);
  if (outcome.frames == 0) {
    throw SourceError(outcome.broken_off.empty() ? flags.input + ": no frame could be tracked"
                                                 : outcome.broken_off);
  }
  if (wants_mot(flags)) {
    write_file(flags.out, [&](std::ostream& out) { out << outcome.mot; });
  } else if (!flags.out.empty()) {
    write_results(flags.out, tracker.views(), kind);
  }
  print(outcome);
  if (!outcome.broken_off.empty()) throw SourceError(outcome.broken_off);
  return 0;
}

}  // namespace

void add_track(CLI::App& app, Run& run) {
  auto flags = std::make_shared<TrackFlags>();
  CLI::App* command = app.add_subcommand("track", "Tracks a video or a folder of images offline");
  command->add_option("input", flags->input, "Video file, or folder of images")->required();
  flags->config.add_to(*command);
  command->add_option("--out", flags->out,
                      "Poses to this file, format by extension: .csv, .tum, .json, .mot");
  command->add_option("--kind", flags->kind, "Poses to write: measured, filtered or smoothed (filtered)")
      ->check(CLI::IsMember({"measured", "filtered", "smoothed"}));
  command
      ->add_option("--cut", flags->cuts,
                   "Without a configuration: a robot cut from the first frame, "
                   "ID:LEFT,TOP,WIDTH,HEIGHT[,YAW_DEGREES] in pixels")
      ->allow_extra_args(false);
  command
      ->add_option("--metres-per-pixel", flags->metres_per_pixel,
                   "With --cut: scale of the robots' plane under a camera that looks straight down")
      ->check(CLI::Range(1e-6, 1.0));
  command
      ->add_option("--camera-height", flags->camera_height_m,
                   "With --cut: the camera's height in metres (2.5)")
      ->check(CLI::Range(0.1, 100.0));
  command->add_option("--start", flags->start_s, "Capture time of the first frame, Unix seconds (0)")
      ->check(CLI::Range(0.0, 7258118400.0));
  command->add_option("--frame-rate", flags->frame_rate_hz, "Of a folder, frames per second")
      ->check(CLI::Range(0.01, 10000.0));
  command->callback([flags, &run] { run = [flags] { return track(*flags); }; });
}

}  // namespace skylight::service
