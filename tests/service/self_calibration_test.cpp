// A camera that is bumped over a floor with tags, in lockstep: no thread, no clock.
#include "service/self_calibration.hpp"

#include <numbers>

#include <gmock/gmock.h>

#include "service/assembly.hpp"
#include "service/camera_doubt.hpp"
#include "service/sources/simulator.hpp"

namespace skylight::service::test {
namespace {

using testing::HasSubstr;

constexpr double kBumpAt = 3.0;  // s
constexpr double kEnd = 10.0;    // s

/// The scenario with tracker, watch and re-calibration, one frame after the other.
class Lockstep {
 public:
  explicit Lockstep(const std::vector<std::string>& changes = {}, bool recalibrate = true)
      : room_(std::make_shared<SimulatorFrames>(run_of(changes))),
        assembly_(assemble(Config{}, room_)),
        tracker_(make_tracker(assembly_)),
        recalibrate_(recalibrate) {
    const NamedCamera& named = assembly_.cameras.at(0);
    camera_.id = named.id;
    camera_.model = std::make_shared<const CameraModel>(named.model);
    camera_.calibration =
        std::make_shared<const CalibrationInUse>(CalibrationInUse{calibration_of(named.model, {})});
    camera_.floor_tags = named.floor_tags;
  }

  static ScenarioRun run_of(std::vector<std::string> changes) {
    changes.insert(changes.end(), {"cameras[0].frame_rate_hz=5", "cameras[0].depth.enabled=false",
                                   "events[0].at_s=" + std::to_string(kBumpAt)});
    ScenarioRun run = scenario_run("hard/bumped-tags", std::nullopt, changes);
    run.cut(kEnd);
    return run;
  }

  struct Judged {
    double at = 0.0;     ///< s of the scenario
    double error = 0.0;  ///< m
    double sigma = 0.0;  ///< m, of the place, both axes
    bool confident_wrong() const { return error > 0.01 && error > 3.0 * sigma; }
  };

  bool step() {
    const auto frame = room_->next();
    if (!frame) return false;
    const auto reports = tracker_.process(*frame);
    camera_.captured = frame->captured;
    camera_.image = frame->image;
    for (const RobotReport& report : reports) judge(report, to_seconds(frame->captured - room_->start()));
    if (auto event = take_hold(watch_.look(*frame), 0, camera_, tracker_))
      events.push_back(std::move(*event));
    if (recalibrate_ && camera_.hold->hold == CameraHold::moved) recalibrate();
    return true;
  }
  void play() {
    while (step()) {
    }
  }

  /// When an event of this kind came first, s of the scenario.
  std::optional<double> first(const std::string& kind) const {
    const auto at = std::find(kinds_.begin(), kinds_.end(), kind);
    if (at == kinds_.end()) return std::nullopt;
    return times_[static_cast<std::size_t>(at - kinds_.begin())];
  }

  CameraSnapshot camera_;
  std::vector<Event> events;
  std::vector<Judged> judged;
  std::shared_ptr<SimulatorFrames> room_;

 private:
  void judge(const RobotReport& report, double at) {
    while (kinds_.size() < events.size()) {
      times_.push_back(at);
      kinds_.push_back(events[kinds_.size()].kind);
    }
    if (!report.filtered) return;
    for (const Truth& truth : room_->truth()) {
      if (truth.id != report.id) continue;
      const Estimate& e = *report.filtered;
      judged.push_back({at, (e.pose.position() - truth.pose.position()).norm(),
                        std::sqrt(e.covariance(0, 0) + e.covariance(1, 1))});
    }
  }

  void recalibrate() {
    if (!work_) work_.emplace(camera_.floor_tags);
    const CalibrationFile& before = camera_.calibration->document;
    const auto outcome = work_->look(camera_.image, camera_.captured, before);
    if (!outcome) return;
    if (!outcome->result) {
      events.push_back(recalibration_failed_event(camera_.id, outcome->reason));
      return;
    }
    events.push_back(recalibrated_event(camera_.id, before, *outcome->result));
    auto document = recalibrated_document(before, *outcome->result, camera_.captured);
    tracker_.recalibrate(0, camera_model(document), uncertainty_of(document));
    camera_.model = std::make_shared<const CameraModel>(camera_model(document));
    camera_.calibration = std::make_shared<const CalibrationInUse>(CalibrationInUse{std::move(document)});
    end_doubt(camera_);
    watch_.relearn();
    camera_.hold = watch_.report();
    work_.reset();
  }

  Assembly assembly_;
  Tracker tracker_;
  CameraWatch watch_;
  std::optional<Recalibrator> work_;
  bool recalibrate_;
  std::vector<std::string> kinds_;
  std::vector<double> times_;
};

double worst_error(const Lockstep& run, double from, double to) {
  double worst = 0.0;
  for (const auto& judged : run.judged) {
    if (judged.at > from && judged.at <= to) worst = std::max(worst, judged.error);
  }
  return worst;
}

int confident_wrong(const Lockstep& run, double from, double to) {
  return static_cast<int>(std::count_if(run.judged.begin(), run.judged.end(), [&](const auto& judged) {
    return judged.at > from && judged.at <= to && judged.confident_wrong();
  }));
}

TEST(SelfCalibration, ABumpOfADegreeIsNoticedAllowedForAndUndone) {
  Lockstep run;
  run.play();
  const auto moved = run.first("camera.moved");
  const auto recalibrated = run.first("camera.recalibrated");
  ASSERT_TRUE(moved && recalibrated) << run.events.size() << " events";
  EXPECT_LT(*moved, kBumpAt + 5.0);
  EXPECT_NEAR(run.events.at(0).data["degrees"], 1.0, 0.2) << run.events.at(0).message;
  // Before, in between, after.
  EXPECT_LT(worst_error(run, 1.0, kBumpAt), 0.003);
  EXPECT_GT(worst_error(run, kBumpAt, *moved), 0.03);
  EXPECT_GT(confident_wrong(run, kBumpAt, *moved), 0) << "nobody could know yet";
  EXPECT_EQ(confident_wrong(run, *moved, kEnd), 0);
  EXPECT_LT(worst_error(run, *recalibrated + 0.5, kEnd), 0.003);
  std::printf(
      "a bump of 1 degree: %.1f mm off until it is noticed after %.1f s, calibrated after %.1f s, then %.1f "
      "mm\n",
      1e3 * worst_error(run, kBumpAt, *moved), *moved - kBumpAt, *recalibrated - kBumpAt,
      1e3 * worst_error(run, *recalibrated + 0.5, kEnd));
  // What it found out is the truth.
  const Eigen::Isometry3d found = run.camera_.model->map_from_camera();
  const Eigen::Isometry3d off = run.room_->map_from_camera(0).inverse() * found;
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 0.1 * std::numbers::pi / 180.0);
  EXPECT_LT(off.translation().norm(), 0.006);
  EXPECT_EQ(run.camera_.hold->hold, CameraHold::steady) << "it watches anew";
  const CalibrationFile& document = run.camera_.calibration->document;
  ASSERT_TRUE(document.extrinsics_made);
  EXPECT_THAT(document.extrinsics_made->made, HasSubstr("T"));
  EXPECT_GE(document.extrinsics_made->sources.size(), 8U);
}

TEST(SelfCalibration, PosesOfTheBumpedCameraCarryAWarningUntilItIsCalibrated) {
  Lockstep run;
  run.play();
  const auto at = [&](double seconds) { return run.room_->start() + from_seconds(seconds); };
  const double until = run.first("camera.recalibrated").value();
  EXPECT_EQ(warning_of(run.camera_, at(kBumpAt - 1.0)), "");
  EXPECT_EQ(warning_of(run.camera_, at(until - 0.5)), "camera ceiling was moved");
  EXPECT_EQ(warning_of(run.camera_, at(until + 0.5)), "");
}

TEST(SelfCalibration, WithoutItThePosesStayWrongButSaySo) {
  Lockstep run({}, false);
  run.play();
  const auto moved = run.first("camera.moved");
  ASSERT_TRUE(moved);
  EXPECT_GT(worst_error(run, *moved, kEnd), 0.03);
  EXPECT_EQ(confident_wrong(run, *moved, kEnd), 0);
  EXPECT_EQ(warning_of(run.camera_, run.camera_.captured), "camera ceiling was moved");
  EXPECT_EQ(run.events.size(), 1U);
}

TEST(SelfCalibration, TooFewTagsAreAReasonAndItIsTriedAgainLater) {
  Lockstep run({"room.floor.tags=[{\"id\": 100, \"x_m\": -1.0, \"y_m\": 1.0}]"});
  run.play();
  EXPECT_FALSE(run.first("camera.recalibrated"));
  std::vector<Event> failed;
  for (const Event& event : run.events) {
    if (event.kind == "camera.recalibration_failed") failed.push_back(event);
  }
  ASSERT_GE(failed.size(), 1U);
  EXPECT_LE(failed.size(), 3U) << "it backs off";
  EXPECT_THAT(failed[0].message, HasSubstr("of 1 floor tags 1 are seen, at least 2 are needed"));
  EXPECT_EQ(failed[0].severity, Severity::warning);
}

/// Looks at one frame of the scenario before its bump, with tags that are said to lie elsewhere.
std::string refusal(const std::function<void(std::vector<FloorTag>&)>& spoil) {
  SimulatorFrames room(Lockstep::run_of({}));
  std::vector<FloorTag> tags = room.floor_tags();
  spoil(tags);
  FloorTagLooks looks(tags);
  const CameraModel& camera = room.cameras().at(0).model;
  for (int i = 0; i < FloorTagLooks::kFrames; ++i) looks.look(room.next()->image, camera);
  try {
    const auto result = looks.solve(calibration_of(camera, {}));
    return {};
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(SelfCalibration, TagsThatLieElsewhereThanStatedAreNotBelieved) {
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& tags) { tags[1].x_m += 0.1; }), "") << "one is left out";
  EXPECT_NE(refusal([](auto& tags) {
              for (auto& tag : tags) tag.size_m *= 1.3;
            }),
            "");
}

TEST(SelfCalibration, TagsInOneCornerLeaveTheRestOfTheFloorUnknown) {
  const std::string why = refusal([](auto& tags) { tags.erase(tags.begin() + 1, tags.end()); });
  EXPECT_THAT(why, HasSubstr("at least 2 are needed"));
  const std::string near = refusal([](auto& tags) {
    for (auto& tag : tags) tag.place_sigma_m = 0.05;
  });
  EXPECT_THAT(near, HasSubstr("leave the floor unknown by"));
}

}  // namespace
}  // namespace skylight::service::test
