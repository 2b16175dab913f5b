#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>

#include <opencv2/imgcodecs.hpp>

#include "service/assembly.hpp"
#include "service/commands/commands.hpp"
#include "service/wire.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

struct SimulateFlags {
  std::string scenario;
  std::string out;
  double duration_s = 0.0;
  std::optional<std::uint64_t> seed;
};

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

/// What a camera's folder holds: pictures, depth/, frames.csv.
class CameraFolder {
 public:
  explicit CameraFolder(fs::path folder) : folder_(std::move(folder)) {
    fs::create_directories(folder_);
    times_.open(folder_ / "frames.csv");
    times_ << "file,captured\n";
  }

  void write(const Frame& frame) {
    const std::string name = number(frame.sequence) + ".png";
    write_picture(folder_ / name, frame.image);
    if (!frame.depth.empty()) {
      fs::create_directories(folder_ / "depth");
      write_picture(folder_ / "depth" / name, frame.depth);
    }
    times_ << name << ',' << fixed(unix_seconds(frame.captured), 6) << '\n';
    if (!times_.flush()) throw std::runtime_error((folder_ / "frames.csv").string() + ": cannot be written");
  }

 private:
  static std::string number(std::uint64_t sequence) {
    const std::string digits = std::to_string(sequence);
    return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits;
  }
  static void write_picture(const fs::path& path, const cv::Mat& image) {
    if (!cv::imwrite(path.string(), image, {cv::IMWRITE_PNG_COMPRESSION, 1}))
      throw std::runtime_error(path.string() + ": cannot be written");
  }

  fs::path folder_;
  std::ofstream times_;
};

/// truth.csv for all robots, truth.<robot>.tum for each.
class TruthFiles {
 public:
  TruthFiles(const fs::path& folder, const std::vector<SimulatedRobot>& robots)
      : folder_(folder), csv_(folder / "truth.csv") {
    csv_ << "camera,robot,captured,x,y,yaw,vx,vy,yaw_rate,in_view\n";
    for (const SimulatedRobot& robot : robots) tum_.emplace_back(folder / ("truth." + robot.id + ".tum"));
  }

  void write(const std::string& camera, Time captured, const std::vector<Truth>& truth) {
    const std::string at = fixed(unix_seconds(captured), 6);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Truth& t = truth[i];
      csv_ << camera << ',' << t.id << ',' << at;
      for (const double value :
           {t.pose.x, t.pose.y, t.pose.yaw, t.velocity.x, t.velocity.y, t.velocity.yaw_rate})
        csv_ << ',' << fixed(value, 9);
      csv_ << ',' << (t.in_view ? 1 : 0) << '\n';
      tum_[i] << at << ' ' << fixed(t.pose.x, 9) << ' ' << fixed(t.pose.y, 9) << " 0 0 0 "
              << fixed(std::sin(t.pose.yaw / 2), 9) << ' ' << fixed(std::cos(t.pose.yaw / 2), 9) << '\n';
    }
    const bool whole =
        csv_.good() && std::all_of(tum_.begin(), tum_.end(), [](const auto& f) { return f.good(); });
    if (!whole) throw std::runtime_error((folder_ / "truth.csv").string() + ": the truth cannot be written");
  }

 private:
  fs::path folder_;
  std::ofstream csv_;
  std::vector<std::ofstream> tum_;
};

// The cameras, appearances and robots as a configuration, so that `skylight track DIR/<camera> --config
// DIR/config.json` finds all it needs.
void write_config(const fs::path& folder, const SimulatorFrames& simulator) {
  fs::create_directories(folder / "appearances");
  Json cameras = Json::array();
  for (const SimulatedCamera& camera : simulator.cameras()) {
    const CameraSnapshot as_snapshot{
        .id = camera.id, .model = std::make_shared<const CameraModel>(camera.model), .image = {}};
    const Json whole = to_json(as_snapshot);
    cameras.push_back({{"id", camera.id},
                       {"intrinsics", whole["intrinsics"]},
                       {"map_from_camera", whole["map_from_camera"]}});
  }
  Json appearances = Json::array();
  Json robots = Json::array();
  for (const SimulatedRobot& robot : simulator.robots()) {
    const Picture& picture = robot.appearance->picture();
    const std::string file = "appearances/" + robot.id + ".png";
    if (!cv::imwrite((folder / file).string(), picture.image))
      throw std::runtime_error((folder / file).string() + ": cannot be written");
    appearances.push_back(
        {{"id", robot.id},
         {"image", file},
         {"metres_per_pixel", picture.metres_per_pixel},
         {"surface_height_m", picture.surface_height_m},
         {"reference_point_m", {picture.reference_point_m.x(), picture.reference_point_m.y()}}});
    robots.push_back({{"id", robot.id}, {"appearance", robot.id}});
  }
  const SimulatedCamera& first = simulator.cameras().front();
  const Json config{{"source",
                     {{"type", "folder"},
                      {"path", first.id},
                      {"camera", first.id},
                      {"frame_rate_hz", first.frame_rate_hz}}},
                    {"cameras", cameras},
                    {"appearances", appearances},
                    {"robots", robots}};
  std::ofstream out(folder / "config.json");
  out << config.dump(2) << "\n";
  out.flush();
  if (!out) throw std::runtime_error((folder / "config.json").string() + ": cannot be written");
}

int simulate(const SimulateFlags& flags) {
  SimulatorFrames simulator(flags.scenario, flags.seed);
  double duration = simulator.duration_s();
  if (flags.duration_s > 0) duration = duration > 0 ? std::min(duration, flags.duration_s) : flags.duration_s;
  if (!(duration > 0)) throw UsageError(flags.scenario + ": this scenario never ends; say --duration");
  const fs::path folder = flags.out.empty() ? fs::path(simulator.name()) : fs::path(flags.out);
  fs::create_directories(folder);
  write_config(folder, simulator);

  std::vector<CameraFolder> cameras;
  for (const SimulatedCamera& camera : simulator.cameras()) cameras.emplace_back(folder / camera.id);
  TruthFiles truth(folder, simulator.robots());
  Progress progress(simulator.name(),
                    static_cast<std::size_t>(duration * simulator.cameras().front().frame_rate_hz));
  std::size_t frames = 0;
  std::optional<Time> first;
  while (const auto frame = simulator.next()) {
    if (!first) first = frame->captured;
    if (to_seconds(frame->captured - *first) >= duration) break;
    cameras[frame->camera].write(*frame);
    truth.write(simulator.cameras()[frame->camera].id, frame->captured, simulator.truth());
    ++frames;
    progress.step();
  }
  std::printf("%zu frames in %s; track them with: skylight track %s --config %s\n", frames, folder.c_str(),
              (folder / simulator.cameras().front().id).c_str(), (folder / "config.json").c_str());
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, Run& run) {
  auto flags = std::make_shared<SimulateFlags>();
  CLI::App* command =
      app.add_subcommand("simulate", "Runs a scenario as fast as it can: frames, depth and truth on disk");
  command->add_option("scenario", flags->scenario, "Scenario: a name, or a .json file")->required();
  command->add_option("--out", flags->out, "Folder to write to (the scenario's name)");
  command->add_option("--duration", flags->duration_s, "Stop after so many seconds of the scenario")
      ->check(CLI::Range(0.001, 86400.0));
  command->add_option("--seed", flags->seed, "Instead of the scenario's")->check(CLI::NonNegativeNumber);
  command->callback([flags, &run] { run = [flags] { return simulate(*flags); }; });
}

}  // namespace skylight::service
