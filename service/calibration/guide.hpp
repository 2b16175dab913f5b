// Guided intrinsics calibrations: somebody moves a board before a live camera and is told which views are
// taken, and which are missing. On a thread of its own: neither tracking nor any request waits until a board
// is found in a frame, or for the fit at the end.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "service/calibration/desk.hpp"
#include "service/calibration/views.hpp"

namespace skylight::service {

enum class GuideState : std::uint8_t {
  collecting,  ///< looks at the camera's frames
  fitting,
  done,  ///< there is a result, and it is in use
};
std::string_view to_string(GuideState state);

struct GuideResult {
  calibration::IntrinsicsResult fit;
  CalibrationKept kept;
};

/// What becomes of a frame.
struct GuideFrame {
  Time captured{};
  std::vector<Pixel> corners;  ///< of the board, empty where it is not seen
  bool taken = false;
  std::string why_not;
};

struct GuideView {
  Time captured{};
  std::vector<Pixel> corners;
};

/// How far a guided calibration is.
struct GuideProgress {
  GuideState state = GuideState::collecting;
  calibration::Board board;
  std::optional<LensModel> lens;  ///< absent: the views decide
  Time started{};
  std::uint64_t frames = 0;  ///< looked at
  std::optional<GuideFrame> newest;
  std::vector<GuideView> views;
  calibration::Coverage coverage;
  std::vector<std::string> missing;  ///< which views would help, in words
  std::string suspicion;             ///< what may be wrong with the board's description
  std::string refusal;               ///< why the fit that was asked for gave nothing
  std::shared_ptr<const GuideResult> result;
};

struct GuideRequest {
  calibration::Board board;
  std::optional<LensModel> lens{};
};

/// The camera is being calibrated already, or is not.
struct GuideConflict : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class IntrinsicsGuide {
 public:
  IntrinsicsGuide(Pipeline& pipeline, CalibrationDesk& desk);
  /// Waits for a fit that is under way.
  ~IntrinsicsGuide();
  IntrinsicsGuide(const IntrinsicsGuide&) = delete;
  IntrinsicsGuide& operator=(const IntrinsicsGuide&) = delete;

  static constexpr std::size_t kFewestViews = 3;
  static constexpr std::size_t kGoodViews = 10;
  static constexpr std::size_t kMostViews = 60;

  /// Throws GuideConflict where the camera is being calibrated; one that is done makes room.
  void start(const std::string& camera, const GuideRequest& request);
  /// None where the camera is not being calibrated.
  std::optional<GuideProgress> progress(const std::string& camera) const;
  /// Asks for the fit; progress() tells what becomes of it. Throws GuideConflict where nothing is collected
  /// for the camera, or fewer than kFewestViews views.
  void finish(const std::string& camera);
  /// Forgets it; a fit under way is thrown away. False where there is none.
  bool cancel(const std::string& camera);

 private:
  struct Session {
    std::string camera;
    calibration::ViewCollector collector;  ///< the thread's
    std::optional<Time> newest{};
    GuideProgress progress{};  ///< under the lock
    bool cancelled = false;    ///< under the lock
  };
  using Sessions = std::map<std::string, std::shared_ptr<Session>>;

  void run();
  void serve(Session& session);
  void look(Session& session, const CameraSnapshot& camera);
  void fit(Session& session, const CameraSnapshot& camera);
  void refuse(Session& session, const std::string& why);

  Pipeline& pipeline_;
  CalibrationDesk& desk_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  Sessions sessions_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace skylight::service
