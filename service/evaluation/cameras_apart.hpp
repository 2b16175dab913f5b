// What several cameras are worth: a tracker over all of them against trackers over one each, on the same
// frames, judged at the same instants.
#pragma once

#include <string>
#include <vector>

#include "service/assembly.hpp"
#include "service/sources/simulator.hpp"
#include "service/wire.hpp"
#include "tracker/metrics.hpp"

namespace skylight::service {

struct CamerasScore {
  /// Where this camera and at least another one had the robot in view, and both trackers a pose.
  struct Camera {
    std::string id;
    std::vector<double> alone_m;     ///< position errors of the tracker over this camera alone
    std::vector<double> together_m;  ///< of the tracker over all, at the same instants
  };
  std::vector<Camera> cameras;
  /// From one frame of any camera to the next: by how much the error of the tracker over all changed, which
  /// is its motion less the true one.
  std::vector<double> steps_m;
  /// Those of them within a second after a camera began or ceased to have the robot in view.
  std::vector<double> hand_over_m;

  /// Pools another run's.
  void merge(const CamerasScore& other);
  /// Together over alone, mean errors, of the camera for which that is largest: above 1 the best camera alone
  /// would have been better. 0 where no two cameras saw a robot.
  double worst_ratio() const;
  double mean_ratio() const;
};

class CamerasApart {
 public:
  static constexpr Duration kGrace = std::chrono::seconds(2);  ///< from the first frame on, nothing is judged

  CamerasApart(const SimulatorFrames& simulator, const Assembly& assembly);

  void process(const Frame& frame, const std::vector<Truth>& truth);
  CamerasScore result() const { return score_; }

 private:
  using Errors = std::vector<std::optional<Eigen::Vector2d>>;  ///< by robot

  static Errors errors(const Tracker& tracker, Time at, const std::vector<Truth>& truth);
  void judge(const Frame& frame, const std::vector<Truth>& truth, const Errors& together);

  std::vector<std::string> robots_;
  Tracker together_;
  std::vector<Tracker> alone_;              ///< by camera
  std::vector<std::vector<bool>> in_view_;  ///< by camera, by robot: of its newest frame
  std::vector<Time> view_changed_;          ///< by robot
  std::optional<Time> first_, newest_;
  Errors last_;
  CamerasScore score_;
};

/// {cameras: [{id, frames, alone_m, together_m, ratio}], worst_ratio, mean_ratio, step_m: {p99, max},
/// hand_over_m: the same}
Json to_json(const CamerasScore& score);
void print_cameras(const CamerasScore& score);

}  // namespace skylight::service
