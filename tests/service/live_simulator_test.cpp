// The simulator under people's hands, and the pipeline that goes on over another one.
#include "service/sources/live_simulator.hpp"

#include <future>

#include <gmock/gmock.h>

#include "service/assembly.hpp"
#include "tests/service/fakes.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

std::shared_ptr<LiveSimulator> live(const RoomFolder& folder, const std::string& more = "\"duration_s\": 0.5",
                                    const std::string& camera = {}) {
  const std::string file = folder.write("room.json", small_scenario(more, camera));
  return std::make_shared<LiveSimulator>(std::make_unique<SimulatorFrames>(file, std::nullopt), 1.0);
}

TEST(LiveSimulator, TellsTheTruthOfItsNewestFrameAndEndsWithItsScenario) {
  const RoomFolder folder;
  const auto simulator = live(folder, "\"duration_s\": 0.2");
  EXPECT_TRUE(simulator->status().truth.empty());
  const auto frame = simulator->next();
  ASSERT_TRUE(frame);
  simulator->stamped(kStart);
  SimulatorStatus status = simulator->status();
  EXPECT_EQ(status.state, RunState::running);
  ASSERT_EQ(status.truth.size(), 1U);
  EXPECT_NEAR(status.truth[0].pose.x, 0.2, 1e-3);
  EXPECT_EQ(status.captured, kStart);
  while (simulator->next()) {
  }
  EXPECT_EQ(simulator->status().state, RunState::ended);
  EXPECT_FALSE(simulator->run());
  EXPECT_FALSE(simulator->pause());
  EXPECT_FALSE(simulator->step(1));
  EXPECT_FALSE(simulator->drive({.robot = "anna"}));
  EXPECT_FALSE(simulator->next()) << "and stays at its end";
}

TEST(LiveSimulator, StandsWhilePausedAndTakesExactlyTheStepsItIsGiven) {
  const RoomFolder folder;
  const auto simulator = live(folder);
  EXPECT_FALSE(simulator->step(1)) << "it runs";
  ASSERT_TRUE(simulator->pause());
  auto waiting = std::async(std::launch::async, [&] {
    std::vector<std::uint64_t> sequences;
    while (const auto frame = simulator->next()) sequences.push_back(frame->sequence);
    return sequences;
  });
  ASSERT_TRUE(simulator->step(2));
  ASSERT_TRUE(simulator->step(1));
  while (simulator->status().truth.empty() || simulator->status().time < milliseconds(66))
    std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(waiting.wait_for(milliseconds(50)), std::future_status::timeout)
      << "three frames, then it stands";
  const Duration time = simulator->status().time;
  EXPECT_LT(time, milliseconds(100));
  simulator->interrupt();
  EXPECT_THAT(waiting.get(), testing::ElementsAre(0, 1, 2));
}

TEST(LiveSimulator, FramesOfSeveralCamerasComeInTheOrderInWhichTheyArrive) {
  const RoomFolder folder;
  std::string scenario = small_scenario("\"duration_s\": 0.3", R"("delivery": {"latency_s": 0.1})");
  const std::string quick = R"({"id": "quick", "position_m": [0, 0, 1.5], "width_px": 160, "height_px": 120,
    "fx_px": 125, "fy_px": 125, "frame_rate_hz": 30, "first_frame_s": 0.01}, )";
  scenario.insert(scenario.find("{\"id\": \"ceiling\""), quick);
  LiveSimulator simulator(std::make_unique<SimulatorFrames>(folder.write("two.json", scenario), std::nullopt),
                          1.0);
  std::vector<Time> delivered;
  std::vector<std::size_t> cameras;
  while (const auto frame = simulator.next()) {
    delivered.push_back(simulator.delivered());
    cameras.push_back(frame->camera);
    EXPECT_EQ(simulator.status().camera, frame->camera) << "the truth is this frame's";
  }
  EXPECT_EQ(delivered.size(), 18U);
  EXPECT_TRUE(std::is_sorted(delivered.begin(), delivered.end()));
  EXPECT_THAT(std::vector(cameras.begin(), cameras.begin() + 4), testing::ElementsAre(0, 0, 0, 1))
      << "three of the quick one before the first of the slow one";
}

TEST(LiveSimulator, WhatItCannotDoIsRefusedWithTheKeyAndItGoesOn) {
  const RoomFolder folder;
  const auto simulator = live(folder);
  EXPECT_THROW(simulator->act(R"({"do": "fly"})", "body"), settings::Error);
  EXPECT_THROW(simulator->act(R"({"do": "light", "level": -1})", "body"), settings::Error);
  EXPECT_THROW(simulator->act(R"({"do": "power", "robot": "nobody", "on": false})", "body"),
               std::invalid_argument);
  EXPECT_THROW(simulator->drive({.robot = "nobody", .v_mps = 0.1}), std::invalid_argument);
  EXPECT_TRUE(simulator->next());
}

/// The pipeline over a scenario, in real time.
struct LivePipeline {
  explicit LivePipeline(std::shared_ptr<LiveSimulator> simulator)
      : pipeline(pipeline_parts(assemble(Config{}, simulator)), {.log = {}}) {
    pipeline.start();
  }
  template <class Pleases>
  std::shared_ptr<const Snapshot> wait_for(Pleases pleases) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    for (;;) {
      auto snapshot = pipeline.snapshot();
      if (pleases(*snapshot)) return snapshot;
      if (std::chrono::steady_clock::now() > deadline) return nullptr;
      std::this_thread::sleep_for(milliseconds(1));
    }
  }
  Pipeline pipeline;
};

TEST(LivePipeline, StopsWhileItsSimulatorIsPaused) {
  const RoomFolder folder;
  const auto simulator = live(folder);
  simulator->pause();
  LivePipeline running(simulator);
  running.pipeline.stop();
  EXPECT_EQ(running.pipeline.snapshot()->captured, Time{});
}

TEST(LivePipeline, GoesOnOverAnotherScenarioWithItsCamerasAndRobotsAndKeepsWaitingChanges) {
  const RoomFolder folder;
  LivePipeline running(live(folder));
  ASSERT_TRUE(running.wait_for([](const Snapshot& s) { return s.cameras.at(0).frames > 0; }));
  const auto before = running.pipeline.snapshot();
  std::string other = small_scenario("\"duration_s\": 0.5");
  for (const auto& [from, to] : {std::pair{"\"ceiling\"", "\"west\""}, std::pair{"\"anna\"", "\"ben\""}})
    other.replace(other.find(from), std::string(from).size(), to);
  auto next = std::make_shared<LiveSimulator>(
      std::make_unique<SimulatorFrames>(folder.write("other.json", other), std::nullopt), 1.0);
  running.pipeline.restart(pipeline_parts(assemble(Config{}, next)));
  const auto after = running.pipeline.snapshot();
  EXPECT_EQ(before->robot("anna")->view.id, "anna") << "who holds the old snapshot has it whole";
  EXPECT_EQ(after->robot("anna"), nullptr);
  ASSERT_NE(after->robot("ben"), nullptr);
  ASSERT_NE(after->camera("west"), nullptr);
  EXPECT_GT(after->sequence, before->sequence);
  running.pipeline.change([](Tracker& tracker) { tracker.remove("ben"); });
  EXPECT_EQ(running.pipeline.snapshot()->robot("ben"), nullptr) << "changes go to the new tracker";
  EXPECT_TRUE(running.wait_for([](const Snapshot& s) { return s.cameras.at(0).frames > 0; }));
  running.pipeline.stop();
  EXPECT_THROW(running.pipeline.restart(pipeline_parts(assemble(Config{}, next))), std::runtime_error);
}

/// Frames that reach the program so long after their capture.
class LateFrames final : public FrameSource {
 public:
  LateFrames(skylight::test::FlatScene scene, Duration late) : scene_(std::move(scene)), late_(late) {}
  std::optional<Frame> next() override {
    if (count_ == 5) return std::nullopt;
    captured_ = kStart + milliseconds(10) * count_++;
    return scene_.render(captured_);
  }
  Time delivered() const override { return captured_ + late_; }

 private:
  skylight::test::FlatScene scene_;
  Duration late_;
  int count_ = 0;
  Time captured_{};
};

TEST(LivePipeline, FramesAreHandedOverWhenTheyAreDeliveredSoTheirAgeShowsTheWay) {
  const auto scene = small_room();
  Pipeline pipeline({.source = std::make_shared<LateFrames>(scene, milliseconds(80)),
                     .cameras = {{"ceiling", scene.camera()}},
                     .tracker = Tracker({scene.camera()})},
                    {.log = {}});
  pipeline.start();
  std::shared_ptr<const Snapshot> snapshot;
  do {
    snapshot = pipeline.snapshot();
    std::this_thread::sleep_for(milliseconds(1));
  } while (snapshot->source != SourceState::ended);
  while (pipeline.snapshot()->cameras[0].frames + pipeline.snapshot()->cameras[0].dropped < 5)
    std::this_thread::sleep_for(milliseconds(1));
  snapshot = pipeline.snapshot();
  EXPECT_GE(snapshot->processed - snapshot->captured, milliseconds(80));
}

}  // namespace
}  // namespace skylight::service::test
