// A simulated run on disk: everything that `skylight simulate` writes, in forms that others read too.
//
//   DIR/config.json, appearances/      cameras and robots as `skylight track --config` takes them
//   DIR/<camera>/frames.csv            file, capture time by the camera's own clock, sequence (gaps: lost)
//   DIR/<camera>/000012.png            pictures, or one video.mkv (FFV1, lossless) or video.mp4 (lossy)
//   DIR/<camera>/depth/000012.png      16 bits, millimetres, 0: no reading
//   DIR/<camera>/mot/gt.txt            MOTChallenge: frame,id,left,top,width,height,1,1,visibility
//   DIR/<camera>/moved.json            only of a camera that was bumped: where it hangs at the end
//   DIR/truth.csv, truth.<robot>.tum   where the robots truly were; the TUM files hold true time
//   DIR/odometry.csv                   what the robots' own odometry says
//   DIR/events.csv                     what took place: true time, name, action as JSON
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <opencv2/videoio.hpp>

#include "service/sources/simulator.hpp"

namespace skylight::service {

enum class RecordingFormat : std::uint8_t { png, video, mp4 };

class Recorder {
 public:
  /// Makes the folder and writes what does not change. Throws std::runtime_error naming what cannot be
  /// written.
  Recorder(const std::filesystem::path& folder, const SimulatorFrames& simulator, RecordingFormat format);

  /// A frame of the simulator with its truth. Throws as above.
  void write(const Frame& frame, const std::vector<Truth>& truth);
  void write(const std::vector<Odometry>& odometry);
  void write(const std::vector<Happening>& happenings);
  /// Notes which cameras hang elsewhere than at the start. Everything is on disk, or it throws.
  void finish(const SimulatorFrames& simulator);

 private:
  struct CameraFiles {
    std::string id;
    std::filesystem::path folder;
    double frame_rate_hz = 0.0;
    std::ofstream frames;
    std::ofstream mot;
    cv::VideoWriter video;
  };

  void write_config(const SimulatorFrames& simulator) const;
  void write_picture(CameraFiles& camera, const Frame& frame, std::string& file);
  void write_truth(const CameraFiles& camera, const Frame& frame, const std::vector<Truth>& truth);

  std::filesystem::path folder_;
  RecordingFormat format_;
  std::vector<CameraFiles> cameras_;
  std::ofstream truth_;
  std::vector<std::ofstream> tum_;
  std::vector<Time> tum_until_;  ///< these files rise in time: cameras that look at once tell it once
  std::ofstream odometry_;
  std::ofstream events_;
};

}  // namespace skylight::service
