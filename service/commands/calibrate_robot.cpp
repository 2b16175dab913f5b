// skylight calibrate robot: how high a robot's picture lies and where, from watching it turn and drive.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <numbers>

#include "service/assembly.hpp"
#include "service/calibration/text.hpp"
#include "service/commands/calibrate.hpp"
#include "service/robot_geometry.hpp"
#include "service/sources/video.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using calibration::GeometryFigure;
using calibration::KnownLength;
using calibration::RobotFit;
using calibration::Stretch;

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kLatest_s = 7258118400.0;  // Unix seconds: the year 2200

struct RobotFlags {
  ConfigFlags config;
  std::vector<std::string> inputs;
  std::string robot;
  std::vector<std::string> odometry;
  std::string distance;
  std::string radius;
  double odometry_sigma = calibration::RobotKnowledge{}.odometry_scale_sigma;
  bool holonomic = false;
  double duration_s = 60.0;
  double start_s = 0.0;
  double frame_rate_hz = 30.0;
  bool json = false;
};

// LENGTH or LENGTH:SIGMA
std::optional<KnownLength> length_of(const std::string& text, const std::string& option) {
  if (text.empty()) return std::nullopt;
  const auto colon = text.find(':');
  const std::string form = "length in metres, LENGTH or LENGTH:SIGMA";
  KnownLength out{.length_m = numbers_of(text.substr(0, colon), 1, option, form)[0]};
  if (colon != std::string::npos) out.sigma_m = numbers_of(text.substr(colon + 1), 1, option, form)[0];
  return out;
}

calibration::RobotKnowledge knowledge_of(const RobotFlags& flags) {
  calibration::RobotKnowledge known{.distance = length_of(flags.distance, "--distance"),
                                    .radius = length_of(flags.radius, "--radius"),
                                    .odometry_scale_sigma = flags.odometry_sigma,
                                    .holonomic = flags.holonomic};
  if (const std::string wrong = calibration::check(known); !wrong.empty()) throw UsageError("--" + wrong);
  return known;
}

// What a robot said of itself, as `skylight simulate` writes it.
void read_odometry(const fs::path& path, const std::string& robot, std::vector<BodyVelocity>& out) {
  const CsvFile file(path);
  const std::size_t stamp = file.column("stamp");
  const std::size_t forward = file.column("v");
  const std::size_t turn = file.column("yaw_rate");
  const auto sideways = file.find_column("v_side");
  const auto whose = file.find_column("robot");
  for (std::size_t row = 0; row < file.rows(); ++row) {
    if (whose && file.text(row, *whose) != robot) continue;
    const double at = file.number(row, stamp);
    if (!(at >= 0.0 && at <= kLatest_s))
      throw std::runtime_error(path.string() + ":" + std::to_string(file.line(row)) +
                               ": stamp is out of range, allowed 0 to 7258118400 (Unix seconds)");
    out.push_back({.at = from_unix_seconds(at),
                   .forward = file.number(row, forward),
                   .sideways = sideways ? file.number(row, *sideways) : 0.0,
                   .yaw_rate = file.number(row, turn)});
  }
}

// Recordings of one or several cameras as one source, in the order of capture.
class Recordings {
 public:
  explicit Recordings(std::vector<std::shared_ptr<FrameSource>> sources) : sources_(std::move(sources)) {
    for (const auto& source : sources_) waiting_.push_back(source->next());
  }
  std::optional<Frame> next() {
    std::size_t first = waiting_.size();
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
      if (waiting_[i] && (first == waiting_.size() || waiting_[i]->captured < waiting_[first]->captured))
        first = i;
    }
    if (first == waiting_.size()) return std::nullopt;
    std::optional<Frame> frame = std::move(waiting_[first]);
    waiting_[first] = sources_[first]->next();
    return frame;
  }

 private:
  std::vector<std::shared_ptr<FrameSource>> sources_;
  std::vector<std::optional<Frame>> waiting_;
};

struct Session {
  Assembly assembly;
  std::vector<std::shared_ptr<FrameSource>> recordings;  ///< empty: the configuration's own source
  std::shared_ptr<SimulatorFrames> simulator;            ///< where that is the simulator
};

std::size_t index_of(const Assembly& assembly, const std::string& camera) {
  const auto at = std::find_if(assembly.cameras.begin(), assembly.cameras.end(),
                               [&](const NamedCamera& named) { return named.id == camera; });
  if (at == assembly.cameras.end()) throw UsageError("the configuration has no camera '" + camera + "'");
  return static_cast<std::size_t>(at - assembly.cameras.begin());
}

Session open_recordings(const RobotFlags& flags) {
  if (flags.config.file.empty()) throw UsageError("which cameras and robots? Give --config");
  Session session;
  for (const std::string& input : flags.inputs) {
    const std::string camera = camera_of_input(flags.config.file, input);
    const bool folder = fs::is_directory(input);
    const FileSourceOptions options{.start = from_unix_seconds(flags.start_s),
                                    .frame_rate_hz = flags.frame_rate_hz};
    if (session.recordings.empty()) {
      Json source{{"type", folder ? "folder" : "video"},
                  {"path", fs::absolute(input).string()},
                  {"start_s", flags.start_s},
                  {"camera", camera}};
      if (folder) source["frame_rate_hz"] = flags.frame_rate_hz;
      session.assembly = assemble(flags.config.load({{"source=" + source.dump(), input}}));
      session.recordings.push_back(session.assembly.source);
      continue;
    }
    FileSourceOptions of_camera = options;
    of_camera.camera = index_of(session.assembly, camera);
    if (folder) {
      session.recordings.push_back(std::make_shared<FolderFrames>(input, of_camera));
    } else {
      session.recordings.push_back(std::make_shared<VideoFrames>(input, of_camera));
    }
  }
  return session;
}

Session open_session(const RobotFlags& flags) {
  if (!flags.inputs.empty()) return open_recordings(flags);
  const Config config = flags.config.load();
  const auto* simulated = std::get_if<SimulatorSource>(&config.source.input);
  if (simulated == nullptr) return {.assembly = assemble(config), .recordings = {}, .simulator = nullptr};
  auto simulator = std::make_shared<SimulatorFrames>(simulated->scenario, simulated->seed);
  return {.assembly = assemble(config, simulator), .recordings = {}, .simulator = simulator};
}

const RobotSpec& robot_of(const Assembly& assembly, const std::string& id) {
  std::string known;
  for (const RobotSpec& robot : assembly.robots) {
    if (robot.id == id || (id.empty() && assembly.robots.size() == 1)) return robot;
    known += (known.empty() ? "" : ", ") + robot.id;
  }
  throw UsageError(id.empty() ? "which robot? Give --robot, one of: " + known
                              : "--robot: there is no robot '" + id + "', there are: " + known);
}

void take(const Frame& frame, const std::string& robot, Tracker& tracker, GeometryRun& run) {
  try {
    for (const RobotReport& report : tracker.process(frame)) {
      if (report.id == robot && report.measured) run.add(*report.measured);
    }
  } catch (const std::invalid_argument& e) {
    std::cerr << "skylight: frame " << frame.sequence << ": " << e.what() << "\n";
  }
}

// The robot alone is tracked: the others neither help nor cost.
GeometryRun watch(const RobotFlags& flags, Session& session, const RobotSpec& robot) {
  Assembly& assembly = session.assembly;
  assembly.robots = {RobotSpec(robot)};
  const RobotSpec& spec = assembly.robots.front();
  std::vector<CameraModel> models;
  for (const NamedCamera& camera : assembly.cameras) models.push_back(camera.model);
  GeometryRun run(spec, models, assembly.tracker.calibration, knowledge_of(flags));
  Tracker tracker = make_tracker(assembly);
  Progress progress(spec.id, 0);
  std::optional<Time> begun;
  const bool recorded = !session.recordings.empty();
  Recordings recordings(session.recordings);
  while (const auto frame = recorded ? recordings.next() : assembly.source->next()) {
    if (!begun) begun = frame->captured;
    if (!recorded && to_seconds(frame->captured - *begun) > flags.duration_s) break;
    take(*frame, spec.id, tracker, run);
    progress.step();
  }
  if (!session.simulator) return run;
  for (const Odometry& said : session.simulator->take_odometry()) {
    if (said.robot == spec.id)
      run.add(BodyVelocity{
          .at = said.at, .forward = said.v_mps, .sideways = said.side_mps, .yaw_rate = said.w_radps});
  }
  return run;
}

void print_stretches(const RobotFit& fit, const GeometryRun& run, const std::vector<std::string>& cameras) {
  std::printf("%-7s %-12s %8s %8s %9s %8s %6s %8s %9s\n", "did", "camera", "from", "for", "turned", "way",
              "used", "dropped", "RMS");
  const auto& seen = run.run().seen;
  for (const Stretch& stretch : fit.stretches) {
    const double from = to_seconds(seen[stretch.first].captured - seen.front().captured);
    const double time = to_seconds(seen[stretch.last].captured - seen[stretch.first].captured);
    std::printf("%-7s %-12s %6.1f s %6.1f s %5.0f deg %6.2f m %6zu %8zu %6.2f mm\n",
                std::string(calibration::to_string(stretch.kind)).c_str(), cameras[stretch.camera].c_str(),
                from, time, kDegrees * stretch.turned_rad, stretch.driven_m, stretch.used, stretch.dropped,
                1e3 * stretch.rms_m);
  }
  for (const auto& reason : fit.left_out)
    std::printf("left out: %zu looks %s\n", reason.count, reason.reason.c_str());
  std::printf(
      "covered: %.0f degrees on the spot, %.2f m driven, %.0f degrees of a circle of %.2f m, %.3f m between "
      "the first and the last of %zu places\n\n",
      kDegrees * fit.spun_rad, fit.driven_m, kDegrees * fit.circled_rad, fit.circle_radius_m, fit.span_m,
      fit.places);
}

// Lengths in metres, their deviations in millimetres, angles in degrees.
std::string value_text(double value, const std::string& unit) {
  if (unit == "m") return calibration::fixed(value, 4) + " m";
  return unit == "rad" ? calibration::fixed(kDegrees * value, 3) + " deg" : calibration::fixed(value, 5);
}

std::string sigma_text(double sigma, const std::string& unit) {
  return unit == "m" ? calibration::fixed(1e3 * sigma, 2) + " mm" : value_text(sigma, unit);
}

void print_figures(const RobotSpec& spec, const RobotFit& fit) {
  for (const NamedFigure& named : figures_of(spec, fit)) {
    const GeometryFigure& figure = *named.figure;
    if (!figure.value && named.key.empty()) continue;
    std::printf("%-18s configured %s, ", named.name.c_str(), value_text(figure.assumed, named.unit).c_str());
    if (!figure.value) {
      std::printf("not measured: %s\n", figure.missing.c_str());
      continue;
    }
    std::printf("measured %s +- %s: ", value_text(*figure.value, named.unit).c_str(),
                sigma_text(figure.sigma, named.unit).c_str());
    if (verdict(figure) == "agrees") {
      std::printf("agrees\n");
    } else {
      std::printf("%.0f sigma off%s%s\n", *figure.sigmas_off(), named.key.empty() ? "" : ": change ",
                  named.key.c_str());
    }
  }
}

void print(const RobotSpec& spec, const RobotFit& fit, const GeometryRun& run,
           const std::vector<std::string>& cameras) {
  std::printf("%s, by its %s: %zu looks\n\n", spec.id.c_str(), spec.appearance ? "picture" : "tag",
              run.run().seen.size());
  print_stretches(fit, run, cameras);
  print_figures(spec, fit);
  for (std::size_t i = 0; fit.surface_height_m.value && i < cameras.size(); ++i) {
    const HeightCost cost = height_cost(fit, run.run().cameras[i]);
    std::printf(
        "%s: a height that is %.1f mm off puts the robot %.2f mm off for each metre from the point under the "
        "camera, %.1f mm at the picture's edge (%.1f m)\n",
        cameras[i].c_str(), 1e3 * std::abs(cost.error_m), 1e3 * std::abs(cost.per_metre_m),
        1e3 * std::abs(cost.at_edge_m), cost.edge_m);
  }
  for (const std::string& remark : fit.remarks) std::printf("note: %s\n", remark.c_str());
}

int calibrate(const RobotFlags& flags) {
  knowledge_of(flags);  // refused before the work
  Session session = open_session(flags);
  const RobotSpec spec = robot_of(session.assembly, flags.robot);
  GeometryRun run = watch(flags, session, spec);
  for (const std::string& file : flags.odometry) {
    std::vector<BodyVelocity> said;
    read_odometry(file, spec.id, said);
    if (said.empty()) throw std::runtime_error(file + ": says nothing of robot '" + spec.id + "'");
    for (const BodyVelocity& reading : said) run.add(reading);
  }
  if (run.run().seen.empty())
    throw std::runtime_error("robot '" + spec.id +
                             "' was not seen: try `skylight track` on the same recording");
  std::vector<std::string> cameras;
  for (const NamedCamera& camera : session.assembly.cameras) cameras.push_back(camera.id);
  const RobotFit fit = run.fit();
  if (flags.json) {
    std::cout << to_json(spec, fit, run.run(), cameras).dump(2) << std::endl;
  } else {
    print(spec, fit, run, cameras);
  }
  return 0;
}

}  // namespace

void add_calibrate_robot(CLI::App& calibrate_command, Run& run) {
  auto flags = std::make_shared<RobotFlags>();
  CLI::App* command = calibrate_command.add_subcommand(
      "robot",
      "How high a robot's picture (or tag) lies above the floor, and where in base_link, from watching it "
      "move.\n\n"
      "Let it stand for 2 s, turn on the spot once round, stand, drive straight on for some metres, stand, "
      "turn once "
      "more, and measure with a tape how far it has come. Turning tells where its centre lies in the "
      "picture, driving "
      "which way it faces, the tape how high the picture is: a camera alone sees a higher robot as a faster "
      "one.\n\n"
      "  skylight calibrate robot --set source.type=simulator --set source.scenario=robot-geometry "
      "--distance 3.597\n"
      "  skylight calibrate robot hall.mkv --config my.json --robot seven --distance 3.6:0.001 --odometry "
      "seven.csv");
  command->add_option(
      "inputs", flags->inputs,
      "Videos or folders of pictures, one for each camera; none: the configuration's own source, live "
      "or simulated");
  flags->config.add_to(*command);
  command->add_option("--robot", flags->robot, "Its id; may be left out where there is only one");
  command->add_option(
      "--distance", flags->distance,
      "Metres between the first and the last place where it stands or turns, LENGTH or LENGTH:SIGMA "
      "(sigma 0.001)");
  command->add_option(
      "--radius", flags->radius,
      "Radius in metres of the circle that it drives, to the point that it turns about, LENGTH or "
      "LENGTH:SIGMA (sigma 0.001)");
  command
      ->add_option("--odometry", flags->odometry,
                   "CSV file of what the robot said of itself: columns stamp, v, yaw_rate and, if you like, "
                   "v_side and "
                   "robot, as `skylight simulate` writes it; its clock within 2 s of the cameras'")
      ->allow_extra_args(false);
  command
      ->add_option("--odometry-sigma", flags->odometry_sigma,
                   "Share by which its odometry's way may be wrong (0.005)")
      ->check(CLI::Range(1e-5, 0.5));
  command->add_flag("--holonomic", flags->holonomic,
                    "It can move sideways: only odometry tells which way it faces");
  command->add_option("--duration", flags->duration_s, "Seconds of a live or simulated source to watch (60)")
      ->check(CLI::Range(1.0, 3600.0));
  command
      ->add_option("--start", flags->start_s, "Capture time of a recording's first frame, Unix seconds (0)")
      ->check(CLI::Range(0.0, kLatest_s));
  command
      ->add_option("--frame-rate", flags->frame_rate_hz,
                   "Of a folder without frames.csv, frames per second (30)")
      ->check(CLI::Range(0.01, 10000.0));
  command->add_flag("--json", flags->json, "For machines");
  command->callback([flags, &run] { run = [flags] { return calibrate(*flags); }; });
}

}  // namespace skylight::service
