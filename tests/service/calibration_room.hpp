// Cameras whose frames the test shows them, and the routes that calibrate them.
#pragma once

#include "service/calibration/guide.hpp"
#include "tests/service/routes_fixture.hpp"

namespace skylight::service::test {

/// Empty where there is none.
inline std::string etag(const Answer& answer) {
  const auto at = answer.headers.find("ETag");
  return at == answer.headers.end() ? "" : at->second;
}

class CalibrationRoom {
 public:
  explicit CalibrationRoom(const std::vector<NamedCamera>& cameras,
                           const std::vector<RobotSpec>& robots = {}) {
    std::vector<CameraModel> models;
    for (const NamedCamera& camera : cameras) models.push_back(camera.model);
    Tracker tracker(std::move(models));
    for (const RobotSpec& robot : robots) tracker.add(robot);
    pipeline = std::make_unique<Pipeline>(
        PipelineParts{
            .source = std::make_shared<FakeFrames>(feed_), .cameras = cameras, .tracker = std::move(tracker)},
        PipelineOptions{.clock = clock_.function(), .log = {}, .watch = CameraWatchConfig{}});
    desk_ = std::make_unique<CalibrationDesk>(*pipeline);
    guide_ = std::make_unique<IntrinsicsGuide>(*pipeline, *desk_);
    context_ = std::make_unique<RouteContext>(RouteContext{.pipeline = *pipeline,
                                                           .appearances = store_,
                                                           .default_method = {},
                                                           .calibration = desk_.get(),
                                                           .guide = guide_.get()});
    add_pose_routes(router_, *context_);
    add_camera_routes(router_, *context_);
    add_calibration_routes(router_, *context_);
    add_intrinsics_routes(router_, *context_);
    add_extrinsics_routes(router_, *context_);
    pipeline->start();
  }
  ~CalibrationRoom() {
    feed_->end();
    pipeline->stop();
  }
  CalibrationRoom(const CalibrationRoom&) = delete;
  CalibrationRoom& operator=(const CalibrationRoom&) = delete;

  /// A frame, so long after the one before; returns when it was tracked.
  void show(const cv::Mat& image, std::size_t camera = 0, Duration after = std::chrono::seconds(2)) {
    clock_.advance(after);
    const auto before = pipeline->snapshot()->cameras[camera].frames;
    feed_->push(
        {.camera = camera, .sequence = ++shown_, .captured = clock_.now(), .image = image, .depth = {}});
    until([&] { return pipeline->snapshot()->cameras[camera].frames > before; });
  }
  /// The same, and what the guided calibration of the first camera says of it.
  Json show_to_guide(const cv::Mat& image, Duration after = std::chrono::seconds(2)) {
    const auto before = guided()["frames"];
    show(image, 0, after);
    until([&] { return guided()["frames"] != before; });
    return guided();
  }
  Json guided() const { return get("/calibration/intrinsics").json(); }
  /// As soon as it is not fitting any more.
  Json fitted() const {
    until([&] { return guided()["state"] != "fitting"; });
    return guided();
  }

  /// Under /api/v1/cameras/ceiling.
  Answer call(const std::string& method, const std::string& target, const Json& body = nullptr,
              const std::map<std::string, std::string>& headers = {}) const {
    return call_route(router_, method, "/api/v1/cameras/ceiling" + target, body.is_null() ? "" : body.dump(),
                      headers);
  }
  Answer get(const std::string& target) const { return call("GET", target); }
  Answer anywhere(const std::string& method, const std::string& target, const Json& body = nullptr) const {
    return call_route(router_, method, "/api/v1" + target, body.is_null() ? "" : body.dump());
  }

  std::unique_ptr<Pipeline> pipeline;

 private:
  template <class Pleases>
  static void until(const Pleases& pleases) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (!pleases()) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "waited in vain";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  FakeClock clock_;
  std::shared_ptr<Feed> feed_ = std::make_shared<Feed>();
  std::uint64_t shown_ = 0;
  AppearanceStore store_{{}};
  std::unique_ptr<CalibrationDesk> desk_;
  std::unique_ptr<IntrinsicsGuide> guide_;
  std::unique_ptr<RouteContext> context_;
  http::Router router_;
};

}  // namespace skylight::service::test
