#include "service/calibration/guide.hpp"

#include <utility>

#include "service/calibration/documents.hpp"
#include "service/pipeline.hpp"

namespace skylight::service {
namespace {

/// Between frames that are looked at: nobody moves a board faster, and others want the processor too.
constexpr std::chrono::milliseconds kBetweenLooks{50};

}  // namespace

std::string_view to_string(GuideState state) {
  switch (state) {
    case GuideState::collecting:
      return "collecting";
    case GuideState::fitting:
      return "fitting";
    case GuideState::done:
      break;
  }
  return "done";
}

IntrinsicsGuide::IntrinsicsGuide(Pipeline& pipeline, CalibrationDesk& desk)
    : pipeline_(pipeline), desk_(desk), thread_([this] { run(); }) {}

IntrinsicsGuide::~IntrinsicsGuide() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void IntrinsicsGuide::start(const std::string& camera, const GuideRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    const auto at = sessions_.find(camera);
    if (at != sessions_.end() && at->second->progress.state != GuideState::done)
      throw GuideConflict("camera '" + camera + "' is being calibrated: finish that, or DELETE it");
    auto session = std::make_shared<Session>(Session{
        .camera = camera, .collector = calibration::ViewCollector(request.board, calibration::kLiveViews)});
    session->progress = {.board = request.board, .lens = request.lens, .started = pipeline_.now()};
    session->progress.missing = calibration::missing_views({});
    sessions_[camera] = std::move(session);
  }
  wake_.notify_all();
}

std::optional<GuideProgress> IntrinsicsGuide::progress(const std::string& camera) const {
  const std::lock_guard lock(mutex_);
  const auto at = sessions_.find(camera);
  if (at == sessions_.end()) return std::nullopt;
  return at->second->progress;
}

void IntrinsicsGuide::finish(const std::string& camera) {
  {
    const std::lock_guard lock(mutex_);
    const auto at = sessions_.find(camera);
    if (at == sessions_.end() || at->second->progress.state != GuideState::collecting)
      throw GuideConflict("no views are being collected for camera '" + camera + "'");
    GuideProgress& progress = at->second->progress;
    if (progress.views.size() < kFewestViews)
      throw GuideConflict("the board is in " + std::to_string(progress.views.size()) +
                          " views so far, at least " + std::to_string(kFewestViews) + " are needed, " +
                          std::to_string(kGoodViews) + " to 20 are good");
    progress.state = GuideState::fitting;
    progress.refusal.clear();
  }
  wake_.notify_all();
}

bool IntrinsicsGuide::cancel(const std::string& camera) {
  const std::lock_guard lock(mutex_);
  const auto at = sessions_.find(camera);
  if (at == sessions_.end()) return false;
  at->second->cancelled = true;
  sessions_.erase(at);
  return true;
}

void IntrinsicsGuide::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    bool busy = false;
    const Sessions sessions = sessions_;
    for (const auto& [camera, session] : sessions) {
      if (stopping_) return;
      if (session->progress.state == GuideState::done || session->cancelled) continue;
      busy = true;
      lock.unlock();
      serve(*session);
      lock.lock();
    }
    if (stopping_) return;
    busy ? void(wake_.wait_for(lock, kBetweenLooks)) : wake_.wait(lock);
  }
}

void IntrinsicsGuide::serve(Session& session) {
  const auto snapshot = pipeline_.snapshot();
  const CameraSnapshot* camera = snapshot->camera(session.camera);
  GuideState state = GuideState::collecting;
  {
    const std::lock_guard lock(mutex_);
    state = session.progress.state;
  }
  if (camera == nullptr) {  // another scenario runs: there is nothing left to calibrate
    cancel(session.camera);
  } else if (state == GuideState::fitting) {
    fit(session, *camera);
  } else if (!camera->image.empty() && session.newest != camera->captured) {
    look(session, *camera);
  }
}

void IntrinsicsGuide::look(Session& session, const CameraSnapshot& camera) {
  session.newest = camera.captured;
  const std::string name = "view " + std::to_string(session.collector.views().size() + 1);
  GuideFrame frame{.captured = camera.captured, .corners = {}, .taken = false, .why_not = {}};
  std::optional<calibration::Coverage> coverage;
  if (session.collector.views().size() >= kMostViews) {
    frame.why_not = "there are " + std::to_string(kMostViews) + " views, which is enough: finish";
  } else {
    try {
      auto looked = session.collector.look(name, camera.image, camera.captured);
      if (looked.seen) frame.corners = std::move(looked.seen->pixels);
      frame.taken = looked.taken;
      frame.why_not = std::move(looked.why_not);
      if (frame.taken)
        coverage = calibration::coverage_of(session.collector.views(), camera.model->intrinsics());
    } catch (const std::exception& error) {  // a picture of another size
      frame.why_not = error.what();
    }
  }
  const std::lock_guard lock(mutex_);
  GuideProgress& progress = session.progress;
  ++progress.frames;
  progress.suspicion = session.collector.suspicion();
  if (coverage) {
    progress.views.push_back({frame.captured, frame.corners});
    progress.coverage = *coverage;
    progress.missing = calibration::missing_views(*coverage);
  }
  progress.newest = std::move(frame);
}

void IntrinsicsGuide::refuse(Session& session, const std::string& why) {
  const std::lock_guard lock(mutex_);
  session.progress.refusal = why;
  session.progress.state = GuideState::collecting;  // more views may help
}

void IntrinsicsGuide::fit(Session& session, const CameraSnapshot& camera) {
  const calibration::ViewCollector& collector = session.collector;
  try {
    auto fitted = calibration::calibrate_intrinsics(collector.views(), {.width_px = collector.size().width,
                                                                        .height_px = collector.size().height,
                                                                        .lens = session.progress.lens});
    fitted.warnings.emplace_back(
        "where the camera hangs was found with the lens before: calibrate its extrinsics next");
    CalibrationFile document = camera.calibration->document;
    set_intrinsics(document, fitted, {},
                   {.made = utc_text(pipeline_.now()), .from = to_string(collector.board())});
    {
      const std::lock_guard lock(mutex_);
      if (session.cancelled) return;
    }
    auto kept = desk_.change({{session.camera, document, tag_of(camera.calibration->document)}}).front();
    const std::lock_guard lock(mutex_);
    session.progress.result =
        std::make_shared<const GuideResult>(GuideResult{std::move(fitted), std::move(kept)});
    session.progress.state = GuideState::done;
  } catch (const std::exception& error) {  // of the views, or of a file that cannot be written
    refuse(session, error.what());
  }
}

}  // namespace skylight::service
