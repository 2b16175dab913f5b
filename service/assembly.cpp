#include "service/assembly.hpp"

#include <algorithm>
#include <optional>

#include <opencv2/imgcodecs.hpp>

#include "service/pose_query.hpp"
#include "service/sources/live/open.hpp"
#include "service/sources/video.hpp"
#include "tracker/mounting.hpp"

namespace skylight::service {
namespace {

// Gives its first frame twice over: once to look at, then again in its turn.
class PeekedFrames final : public FrameSource {
 public:
  explicit PeekedFrames(std::shared_ptr<FrameSource> inner)
      : inner_(std::move(inner)), first_(inner_->next()) {}

  const std::optional<Frame>& first() const { return first_; }
  std::optional<Frame> next() override {
    if (!given_) {
      given_ = true;
      return first_;
    }
    return inner_->next();
  }
  std::uint64_t bad_frames() const override { return inner_->bad_frames(); }
  Time delivered() const override { return inner_->delivered(); }
  std::optional<double> speed() const override { return inner_->speed(); }
  void stamped(Time at) override { inner_->stamped(at); }
  void interrupt() override { inner_->interrupt(); }
  bool live() const override { return inner_->live(); }
  std::vector<FeedStatus> feeds() const override { return inner_->feeds(); }
  void watch(std::function<void()> changed) override { inner_->watch(std::move(changed)); }

 private:
  std::shared_ptr<FrameSource> inner_;
  std::optional<Frame> first_;
  bool given_ = false;
};

std::size_t camera_index(const std::vector<NamedCamera>& cameras, const std::string& id) {
  const auto at = std::find_if(cameras.begin(), cameras.end(),
                               [&](const NamedCamera& camera) { return camera.id == id; });
  if (at == cameras.end()) throw std::invalid_argument("there is no camera '" + id + "'");
  return static_cast<std::size_t>(at - cameras.begin());
}

FileSourceOptions file_options(const std::optional<double>& start_s, double frame_rate_hz, bool loop,
                               std::size_t camera) {
  return {.start = start_s ? from_unix_seconds(*start_s) : system_now(),
          .frame_rate_hz = frame_rate_hz,
          .loop = loop,
          .camera = camera};
}

std::shared_ptr<FrameSource> open_files(const Config& config, const std::vector<NamedCamera>& cameras) {
  if (const auto* video = std::get_if<VideoSource>(&config.source.input)) {
    return std::make_shared<VideoFrames>(
        video->path, file_options(video->start_s, 0.0, video->loop, camera_index(cameras, video->camera)));
  }
  const auto& folder = std::get<FolderSource>(config.source.input);
  return std::make_shared<FolderFrames>(
      folder.path,
      file_options(folder.start_s, folder.frame_rate_hz, folder.loop, camera_index(cameras, folder.camera)));
}

// What the scenario says of cameras, appearances and robots, where the configuration is silent. A robot that
// nothing tells apart cannot be registered.
void take_from_scenario(const Config& config, const SimulatorFrames& simulator, Assembly& assembly) {
  if (config.cameras.empty()) {
    for (const SimulatedCamera& camera : simulator.cameras())
      assembly.cameras.push_back({camera.id, camera.model});
  }
  for (NamedCamera& camera : assembly.cameras) {
    if (camera.floor_tags.empty()) camera.floor_tags = simulator.floor_tags();
  }
  for (const SimulatedRobot& robot : simulator.robots()) {
    if (!robot.appearance) continue;
    assembly.appearances.emplace(robot.appearance->id(), robot.appearance);
    if (!config.robots.empty()) continue;
    const RobotConfig as_configured{.id = robot.id, .tag = robot.tag, .method = config.tracker.method};
    assembly.robots.push_back(robot_spec(as_configured, robot.appearance));
  }
}

// By its name; a simulated robot that names none has its own.
std::shared_ptr<const Appearance> appearance_of(const RobotConfig& robot, const SimulatorFrames* simulator,
                                                const Appearances& appearances) {
  const std::string& name = robot.appearance.value_or(robot.id);
  if (const auto at = appearances.find(name); at != appearances.end()) return at->second;
  if (simulator != nullptr && !robot.appearance) {
    for (const SimulatedRobot& simulated : simulator->robots()) {
      if (simulated.id == robot.id && simulated.appearance) return simulated.appearance;
    }
  }
  if (robot.method.detector == DetectorKind::apriltag && !robot.appearance) return nullptr;
  throw std::invalid_argument("robot '" + robot.id + "': there is no appearance '" + name + "'");
}

// Its own; a simulated robot that names none has the scenario's.
std::optional<TagSpec> tag_of(const RobotConfig& robot, const SimulatorFrames* simulator) {
  if (robot.tag || simulator == nullptr) return robot.tag;
  for (const SimulatedRobot& simulated : simulator->robots()) {
    if (simulated.id == robot.id) return simulated.tag;
  }
  return std::nullopt;
}

// Appearances of the configuration; those cut from a frame look at the source's first one.
std::map<std::string, Pose2> add_appearances(const Config& config, Assembly& assembly) {
  std::map<std::string, Pose2> cut_poses;
  std::unique_ptr<PeekedFrames> peeked;
  for (const AppearanceConfig& appearance : config.appearances) {
    const Frame* frame = nullptr;
    const CameraModel* camera = nullptr;
    if (appearance.cut_from_frame) {
      if (!peeked) peeked = std::make_unique<PeekedFrames>(std::move(assembly.source));
      if (!peeked->first())
        throw SourceError("appearance '" + appearance.id + "': the source has no frame to cut from");
      frame = &*peeked->first();
      const std::size_t index = camera_index(assembly.cameras, appearance.cut_from_frame->camera);
      if (frame->camera != index)
        throw SourceError("appearance '" + appearance.id + "': the source's first frame is another camera's");
      camera = &assembly.cameras[index].model;
    }
    Pose2 pose;
    assembly.appearances[appearance.id] = make_appearance(appearance, frame, camera, &pose);
    if (frame != nullptr) cut_poses[appearance.id] = pose;
  }
  if (peeked) assembly.source = std::move(peeked);
  return cut_poses;
}

}  // namespace

std::shared_ptr<const Appearance> make_appearance(const AppearanceConfig& config, const Frame* frame,
                                                  const CameraModel* camera, Pose2* cut_pose) {
  Picture picture;
  if (config.cut_from_frame) {
    picture = cut_from_frame(*frame, *camera, frame_cut(config), cut_pose);
  } else {
    picture.image = read_picture(*config.image, cv::IMREAD_UNCHANGED);
    picture.metres_per_pixel = *config.metres_per_pixel;
    picture.surface_height_m = config.surface_height_m;
  }
  picture.reference_point_m = {config.reference_point_m[0], config.reference_point_m[1]};
  if (config.cut_from_frame && cut_pose != nullptr) {  // where the box's centre is, until here
    const Eigen::Vector2d base =
        cut_pose->position() + Eigen::Rotation2Dd(cut_pose->yaw) * picture.reference_point_m;
    cut_pose->x = base.x();
    cut_pose->y = base.y();
  }
  return std::make_shared<const Appearance>(config.id, picture);
}

namespace {

std::shared_ptr<const CalibrationInUse> calibration_in_use(const Config& config, const CameraConfig& camera) {
  return std::make_shared<const CalibrationInUse>(CalibrationInUse{
      .document = camera.calibrated ? *camera.calibrated
                                    : calibration_of(camera_model(camera), camera_uncertainty(camera)),
      .file = calibration_path(config, camera)});
}

// `simulator`: what the source shows, where it is the simulator.
Assembly assemble(const Config& config, std::shared_ptr<FrameSource> source,
                  const SimulatorFrames* simulator) {
  Assembly assembly{.source = std::move(source),
                    .posted = {},
                    .cameras = {},
                    .appearances = {},
                    .robots = {},
                    .tracker = tracker_config(config)};
  for (const CameraConfig& camera : config.cameras)
    assembly.cameras.push_back(
        {camera.id, camera_model(camera), calibration_in_use(config, camera), camera.floor_tags});
  if (simulator != nullptr) {
    take_from_scenario(config, *simulator, assembly);
  } else if (std::holds_alternative<CamerasSource>(config.source.input)) {
    OpenedCameras live = open_cameras(config);
    assembly.source = std::move(live.source);
    assembly.posted = std::move(live.posted);
  } else {
    assembly.source = open_files(config, assembly.cameras);
  }
  const auto cut_poses = add_appearances(config, assembly);
  for (const RobotConfig& robot : config.robots) {
    RobotSpec spec = robot_spec(robot, appearance_of(robot, simulator, assembly.appearances));
    spec.tag = tag_of(robot, simulator);
    const auto cut = cut_poses.find(robot.appearance.value_or(robot.id));
    if (cut != cut_poses.end() && !spec.initial_pose) {
      spec.initial_pose = spec.picture_mounting
                              ? Mounting(*spec.appearance, *spec.picture_mounting).base_at(cut->second)
                              : cut->second;
    }
    assembly.robots.push_back(std::move(spec));
  }
  return assembly;
}

}  // namespace

Assembly assemble(const Config& config) {
  const auto* simulated = std::get_if<SimulatorSource>(&config.source.input);
  if (simulated == nullptr) return assemble(config, nullptr, nullptr);
  auto simulator = std::make_unique<SimulatorFrames>(simulated->scenario, simulated->seed);
  return assemble(config, std::make_shared<LiveSimulator>(std::move(simulator), simulated->speed));
}

Assembly assemble(const Config& config, std::shared_ptr<LiveSimulator> live) {
  Assembly assembly = assemble(config, live, &live->shows());
  assembly.live = std::move(live);
  return assembly;
}

Assembly assemble(const Config& config, std::shared_ptr<SimulatorFrames> simulator) {
  return assemble(config, simulator, simulator.get());
}

Tracker make_tracker(const Assembly& assembly) {
  std::vector<CameraModel> models;
  for (const NamedCamera& camera : assembly.cameras) models.push_back(camera.model);
  Tracker tracker(std::move(models), assembly.tracker);
  for (const RobotSpec& robot : assembly.robots) tracker.add(robot);
  return tracker;
}

PipelineParts pipeline_parts(const Assembly& assembly) {
  return {.source = assembly.source, .cameras = assembly.cameras, .tracker = make_tracker(assembly)};
}

}  // namespace skylight::service
