#include "service/recorder.hpp"

#include <cmath>
#include <cstdio>

#include <opencv2/imgcodecs.hpp>

#include "service/config.hpp"
#include "service/mot.hpp"
#include "service/sources/frame_list.hpp"
#include "service/time_text.hpp"
#include "service/wire.hpp"
#include "settings/fields.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

void save(const fs::path& path, const cv::Mat& image) {
  bool done = false;
  try {
    done = cv::imwrite(path.string(), image, {cv::IMWRITE_PNG_COMPRESSION, 1});
  } catch (const cv::Exception&) {  // said below, with the file's name
  }
  if (!done) throw std::runtime_error(path.string() + ": cannot be written");
}

std::ofstream open(const fs::path& path, const std::string& header) {
  fs::create_directories(path.parent_path());
  std::ofstream out(path);
  out << header;
  if (!out.flush()) throw std::runtime_error(path.string() + ": cannot be written");
  return out;
}

void check(const std::ofstream& out, const fs::path& path) {
  if (!out.good()) throw std::runtime_error(path.string() + ": cannot be written");
}

// A field of CSV, quoted where it has to be (RFC 4180).
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ";") + word;
  return out;
}

const char* video_name(RecordingFormat format) {
  return format == RecordingFormat::video ? "video.mkv" : "video.mp4";
}

cv::VideoWriter open_video(const fs::path& path, RecordingFormat format, double frame_rate_hz,
                           const cv::Mat& first) {
  const int code = format == RecordingFormat::video ? cv::VideoWriter::fourcc('F', 'F', 'V', '1')
                                                    : cv::VideoWriter::fourcc('m', 'p', '4', 'v');
  cv::VideoWriter out;
  const std::vector<int> properties{cv::VIDEOWRITER_PROP_IS_COLOR, first.channels() == 3 ? 1 : 0};
  if (!out.open(path.string(), cv::CAP_FFMPEG, code, frame_rate_hz, first.size(), properties))
    throw std::runtime_error(path.string() + ": this OpenCV cannot write such a video");
  return out;
}

Json robots_json(const fs::path& folder, const SimulatorFrames& simulator, Json& appearances) {
  Json robots = Json::array();
  for (const SimulatedRobot& robot : simulator.robots()) {
    if (!robot.appearance) continue;
    const std::string& look = robot.appearance->id();
    robots.push_back({{"id", robot.id}, {"appearance", look}});
    if (robot.tag) robots.back()["tag"] = Json::parse(settings::write(*robot.tag));
    if (look != robot.id) continue;  // a copy
    const Picture& picture = robot.appearance->picture();
    const std::string file = "appearances/" + look + ".png";
    save(folder / file, picture.image);
    appearances.push_back(
        {{"id", look},
         {"image", file},
         {"metres_per_pixel", picture.metres_per_pixel},
         {"surface_height_m", picture.surface_height_m},
         {"reference_point_m", {picture.reference_point_m.x(), picture.reference_point_m.y()}}});
  }
  return robots;
}

}  // namespace

Recorder::Recorder(const fs::path& folder, const SimulatorFrames& simulator, RecordingFormat format)
    : folder_(folder), format_(format) {
  fs::create_directories(folder_ / "appearances");
  write_config(simulator);
  for (const SimulatedCamera& camera : simulator.cameras()) {
    const fs::path place = folder_ / camera.id;
    cameras_.push_back({.id = camera.id,
                        .folder = place,
                        .frame_rate_hz = camera.frame_rate_hz,
                        .frames = open(place / "frames.csv", frame_list_header()),
                        .mot = open(place / "mot" / "gt.txt", ""),
                        .video = {}});
  }
  truth_ = open(folder_ / "truth.csv",
                "camera,robot,captured,at,x,y,yaw,vx,vy,yaw_rate,present,in_view,visible,touches\n");
  for (const SimulatedRobot& robot : simulator.robots())
    tum_.push_back(open(folder_ / ("truth." + robot.id + ".tum"), ""));
  tum_until_.assign(tum_.size(), Time::min());
  odometry_ = open(folder_ / "odometry.csv", "robot,stamp,x,y,yaw,v,v_side,yaw_rate\n");
  events_ = open(folder_ / "events.csv", "at,name,action\n");
}

// The cameras, appearances and robots as a configuration, so that `skylight track DIR/<camera> --config
// DIR/config.json` finds all it needs.
void Recorder::write_config(const SimulatorFrames& simulator) const {
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
  const Json robots = robots_json(folder_, simulator, appearances);
  const SimulatedCamera& first = simulator.cameras().front();
  const Json config{{"source",
                     {{"type", "folder"},
                      {"path", first.id},
                      {"camera", first.id},
                      {"frame_rate_hz", first.frame_rate_hz}}},
                    {"cameras", cameras},
                    {"appearances", appearances},
                    {"robots", robots}};
  open(folder_ / "config.json", config.dump(2) + "\n");
}

void Recorder::write(const Frame& frame, const std::vector<Truth>& truth) {
  CameraFiles& camera = cameras_.at(frame.camera);
  std::string file;
  write_picture(camera, frame, file);
  if (!frame.depth.empty()) {
    const fs::path depth = camera.folder / "depth";
    fs::create_directories(depth);
    save(depth / numbered_picture(frame.sequence), frame.depth);
  }
  camera.frames << frame_list_line({file, frame.captured, frame.sequence});
  check(camera.frames, camera.folder / "frames.csv");
  write_truth(camera, frame, truth);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i].box_px) camera.mot << mot_truth_line(frame.sequence, i, truth[i]);
  }
  check(camera.mot, camera.folder / "mot" / "gt.txt");
}

void Recorder::write_picture(CameraFiles& camera, const Frame& frame, std::string& file) {
  if (format_ == RecordingFormat::png) {
    file = numbered_picture(frame.sequence);
    save(camera.folder / file, frame.image);
    return;
  }
  file = video_name(format_);
  if (!camera.video.isOpened())
    camera.video = open_video(camera.folder / file, format_, camera.frame_rate_hz, frame.image);
  camera.video.write(frame.image);
}

void Recorder::write_truth(const CameraFiles& camera, const Frame& frame, const std::vector<Truth>& truth) {
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Truth& t = truth[i];
    truth_ << camera.id << ',' << t.id << ',' << time_text(frame.captured) << ',' << time_text(t.at);
    for (const double value :
         {t.pose.x, t.pose.y, t.pose.yaw, t.velocity.x, t.velocity.y, t.velocity.yaw_rate})
      truth_ << ',' << fixed(value, 9);
    truth_ << ',' << (t.present ? 1 : 0) << ',' << (t.in_view ? 1 : 0) << ',' << fixed(t.visible, 4) << ','
           << joined(t.touches) << '\n';
    if (!t.present || t.at <= tum_until_[i]) continue;
    tum_until_[i] = t.at;
    tum_[i] << time_text(t.at) << ' ' << fixed(t.pose.x, 9) << ' ' << fixed(t.pose.y, 9) << " 0 0 0 "
            << fixed(std::sin(t.pose.yaw / 2), 9) << ' ' << fixed(std::cos(t.pose.yaw / 2), 9) << '\n';
    check(tum_[i], folder_ / ("truth." + t.id + ".tum"));
  }
  check(truth_, folder_ / "truth.csv");
}

void Recorder::write(const std::vector<Odometry>& odometry) {
  for (const Odometry& o : odometry) {
    odometry_ << o.robot << ',' << time_text(o.at);
    for (const double value : {o.pose.x, o.pose.y, o.pose.yaw, o.v_mps, o.side_mps, o.w_radps})
      odometry_ << ',' << fixed(value, 9);
    odometry_ << '\n';
  }
  check(odometry_, folder_ / "odometry.csv");
}

void Recorder::write(const std::vector<Happening>& happenings) {
  for (const Happening& happening : happenings) {
    events_ << time_text(happening.at) << ',' << csv_field(happening.name) << ','
            << csv_field(Json::parse(happening.action).dump()) << '\n';
  }
  check(events_, folder_ / "events.csv");
}

// The configuration tells where cameras hang at the start, for that is what a tracker would know.
void Recorder::finish(const SimulatorFrames& simulator) {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const Eigen::Isometry3d now = simulator.map_from_camera(i);
    if (now.isApprox(simulator.cameras()[i].model.map_from_camera(), 1e-12)) continue;
    open(cameras_[i].folder / "moved.json", Json{{"map_from_camera", to_json(now)}}.dump(2) + "\n");
  }
  for (CameraFiles& camera : cameras_) {
    camera.video.release();
    camera.frames.flush();
    check(camera.frames, camera.folder / "frames.csv");
    camera.mot.flush();
    check(camera.mot, camera.folder / "mot" / "gt.txt");
  }
  for (std::ofstream* file : {&truth_, &odometry_, &events_}) file->flush();
  check(truth_, folder_ / "truth.csv");
  check(odometry_, folder_ / "odometry.csv");
  check(events_, folder_ / "events.csv");
  for (std::ofstream& tum : tum_) tum.flush();
}

}  // namespace skylight::service
