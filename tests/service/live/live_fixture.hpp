// A service over two live cameras whose pictures a test posts.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "service/pipeline.hpp"
#include "service/sources/live/live_cameras.hpp"
#include "service/sources/live/posted_camera.hpp"
#include "service/sources/live/posted_cameras.hpp"
#include "tests/service/fakes.hpp"

namespace skylight::service::test {

/// Cameras `east` and `west`, both over small_room(); the clock stands still.
struct LiveRoom {
  explicit LiveRoom(bool synchronised = true) {
    std::vector<LiveCameras::Camera> cameras;
    std::vector<NamedCamera> named;
    std::vector<CameraModel> models;
    for (const char* id : {"east", "west"}) {
      auto pictures = std::make_shared<PostedPictures>(PostedOptions{
          .size_px = {320, 240}, .synchronised = synchronised, .silence = std::chrono::hours(1)});
      LiveCameras::Camera& camera = cameras.emplace_back();
      camera.options.kind = "posted";
      camera.options.size_px = {320, 240};
      camera.options.clock = clock.function();
      camera.driver = std::make_unique<PostedCamera>(pictures);
      posted[id] = pictures;
      named.push_back({id, scene.camera()});
      models.push_back(scene.camera());
    }
    Tracker tracker(models);
    tracker.add(robot_of(scene));
    pipeline =
        std::make_unique<Pipeline>(PipelineParts{.source = std::make_shared<LiveCameras>(std::move(cameras)),
                                                 .cameras = named,
                                                 .tracker = std::move(tracker)},
                                   PipelineOptions{.clock = clock.function(), .log = {}});
    pipeline->start();
  }
  ~LiveRoom() { pipeline->stop(); }
  LiveRoom(const LiveRoom&) = delete;
  LiveRoom& operator=(const LiveRoom&) = delete;

  template <class Pleases>
  std::shared_ptr<const Snapshot> wait_for(Pleases pleases) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (std::chrono::steady_clock::now() < deadline) {
      auto snapshot = pipeline->snapshot();
      if (pleases(*snapshot)) return snapshot;
      std::this_thread::yield();
    }
    return nullptr;
  }
  /// Another one each time: a scene is drawn with the same noise every time, as no sensor has it.
  cv::Mat picture(Duration after) {
    cv::Mat image = scene.render(kStart + after).image;
    image.ptr(0)[0] = static_cast<unsigned char>(shots++);
    return image;
  }

  skylight::test::FlatScene scene = small_room();
  FakeClock clock;
  PostedCameras posted;
  int shots = 0;
  std::unique_ptr<Pipeline> pipeline;
};

}  // namespace skylight::service::test
