#include "service/trajectory.hpp"

#include <algorithm>
#include <numeric>
#include <sstream>

#include <gmock/gmock.h>

#include "service/pose_query.hpp"
#include "service/wire.hpp"
#include "tests/service/line_history.hpp"

namespace skylight::service::test {
namespace {

using testing::HasSubstr;

std::string written(const Trajectory& trajectory, TrajectoryFormat format) {
  std::ostringstream out;
  write_trajectory(out, trajectory, format);
  return out.str();
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, at);) parts.push_back(part);
  return parts;
}

// Awkward numbers: far out, close to the wrap, a time between microseconds' tenths.
Trajectory awkward() {
  Trajectory trajectory{.robot = "anna", .kind = PoseKind::filtered, .points = {}};
  for (const double yaw : {-3.141592653, -1.0, 0.0, 1e-9, 2.5, 3.141592653}) {
    TrajectoryPoint point{.captured = kStart + std::chrono::microseconds(123'456),
                          .state = TrackState::tracking,
                          .source = PoseSource::align,
                          .pose = {-98.123456789, 0.000000001, yaw},
                          .velocity = {0.1, -0.2, 0.3},
                          .score = 0.5};
    point.covariance << 1e-6, 2e-7, 3e-8, 2e-7, 4e-6, 5e-8, 3e-8, 5e-8, 6e-6;
    trajectory.points.push_back(point);
  }
  return trajectory;
}

TEST(Trajectory, CsvReadsBackToTheNanometreUnderItsHeader) {
  const Trajectory trajectory = awkward();
  const auto lines = split(written(trajectory, TrajectoryFormat::csv), '\n');
  ASSERT_EQ(lines.size(), trajectory.points.size() + 1);
  const auto header = split(lines[0], ',');
  EXPECT_EQ(lines[0],
            "robot,captured,kind,state,source,x,y,yaw,vx,vy,yaw_rate,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,"
            "cov_yawyaw,score");
  for (std::size_t i = 0; i < trajectory.points.size(); ++i) {
    const auto fields = split(lines[i + 1], ',');
    ASSERT_EQ(fields.size(), header.size());
    EXPECT_EQ(fields[0], "anna");
    EXPECT_EQ(fields[1], "1700000000.123456");
    EXPECT_EQ(fields[2], "filtered");
    EXPECT_EQ(fields[3], "tracking");
    EXPECT_EQ(fields[4], "align");
    EXPECT_NEAR(std::stod(fields[5]), -98.123456789, 1e-9);
    EXPECT_NEAR(std::stod(fields[6]), 1e-9, 1e-15);
    EXPECT_NEAR(std::stod(fields[7]), trajectory.points[i].pose.yaw, 1e-9);
    EXPECT_DOUBLE_EQ(std::stod(fields[9]), -0.2);
    EXPECT_DOUBLE_EQ(std::stod(fields[13]), 3e-8);  // x with yaw
    EXPECT_DOUBLE_EQ(std::stod(fields[14]), 4e-6);
    EXPECT_DOUBLE_EQ(std::stod(fields[17]), 0.5);
  }
}

TEST(Trajectory, TumsQuaternionTurnsBackIntoTheYaw) {
  const Trajectory trajectory = awkward();
  const auto lines = split(written(trajectory, TrajectoryFormat::tum), '\n');
  ASSERT_EQ(lines.size(), trajectory.points.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::istringstream in(lines[i]);
    double t = 0;
    double x = 0;
    double y = 0;
    double z = 0;
    Eigen::Quaterniond q;
    ASSERT_TRUE(in >> t >> x >> y >> z >> q.x() >> q.y() >> q.z() >> q.w());
    EXPECT_NEAR(t, 1'700'000'000.123456, 1e-6);
    EXPECT_NEAR(x, -98.123456789, 1e-9);
    EXPECT_EQ(z, 0.0);
    EXPECT_NEAR(q.norm(), 1.0, 1e-9);
    const Eigen::Vector3d forward = q * Eigen::Vector3d::UnitX();
    EXPECT_NEAR(wrap_angle(std::atan2(forward.y(), forward.x()) - trajectory.points[i].pose.yaw), 0.0, 1e-9);
  }
}

TEST(Trajectory, JsonIsOneObjectAndHasNoNan) {
  Trajectory trajectory = awkward();
  trajectory.points[0].pose.x = std::nan("");
  const Json json = Json::parse(written(trajectory, TrajectoryFormat::json));
  EXPECT_EQ(json["robot"], "anna");
  EXPECT_EQ(json["kind"], "filtered");
  ASSERT_EQ(json["points"].size(), trajectory.points.size());
  EXPECT_TRUE(json["points"][0]["x"].is_null());
  EXPECT_EQ(json["points"][1]["yaw"], -1.0);
  EXPECT_EQ(json["points"][1]["covariance"][5], 5e-8);
  EXPECT_EQ(json["points"][1]["velocity"]["yaw_rate"], 0.3);
}

TEST(Trajectory, TakesTheInstantsOfItsRangeEndsIncluded) {
  const RobotView anna = Line(100).robot.view;
  const Trajectory some = make_trajectory(anna, PoseKind::measured, Line::at(20), Line::at(29));
  ASSERT_EQ(some.points.size(), 10U);
  EXPECT_EQ(some.points.front().captured, Line::at(20));
  EXPECT_DOUBLE_EQ(some.points.back().pose.x, 0.29);
  EXPECT_EQ(make_trajectory(anna, PoseKind::measured, Time{}, Time::max()).points.size(), 100U);
  EXPECT_THAT(make_trajectory(anna, PoseKind::measured, Line::at(200), Time::max()).points,
              testing::IsEmpty());
}

TEST(Trajectory, LeavesOutInstantsWithoutThatKindOfPose) {
  const RobotView anna = Line(100, {50, 51}).robot.view;
  const auto whole = [&](PoseKind kind) { return make_trajectory(anna, kind, Time{}, Time::max()); };
  EXPECT_EQ(whole(PoseKind::measured).points.size(), 98U);
  const Trajectory filtered = whole(PoseKind::filtered);
  ASSERT_EQ(filtered.points.size(), 93U);  // the eighth position completes the calibration
  EXPECT_EQ(filtered.points.front().captured, Line::at(7));
  EXPECT_EQ(filtered.points[43].state, TrackState::predicting);
  EXPECT_EQ(filtered.points[43].source, PoseSource::prediction);
  EXPECT_EQ(filtered.points[43].score, 0.0);
  EXPECT_EQ(filtered.points[45].source, PoseSource::align);
  EXPECT_EQ(filtered.points[45].score, 0.9);
}

TEST(Trajectory, SmoothedHasEveryFrameOnceFinalOrNot) {
  // However much of it has become final when it is asked for.
  for (const int frames : {1, 5, 12, 14, 15, 16, 20, 31, 100}) {
    const RobotView anna = Line(frames, {}, Line::motion()).robot.view;
    const Trajectory whole = make_trajectory(anna, PoseKind::smoothed, Time{}, Time::max());
    ASSERT_EQ(whole.points.size(), static_cast<std::size_t>(frames));
    for (int i = 0; i < frames; ++i) {
      const TrajectoryPoint& p = whole.points[static_cast<std::size_t>(i)];
      EXPECT_EQ(p.captured, Line::at(i));
      EXPECT_EQ(p.source, PoseSource::align);
      EXPECT_NEAR(p.pose.x, Line::kStep * i, 2e-3) << i << " of " << frames;
    }
  }
}

TEST(Trajectory, SmoothedPointsAreThoseThatAQuestionForTheirInstantIsAnsweredWith) {
  const Line line(100, {}, Line::motion());
  const HistoryView& history = line.robot.view.history;
  const std::size_t final = history.settled();
  ASSERT_GT(final, 50U);
  ASSERT_LT(final, 95U);
  const auto about = static_cast<double>(final);
  const Trajectory part =
      make_trajectory(line.robot.view, PoseKind::smoothed, Line::at(about - 3), Line::at(about + 3));
  ASSERT_EQ(part.points.size(), 7U) << "from both sides of what is final";
  for (const TrajectoryPoint& p : part.points) {
    const PoseAnswer asked = answer(line.snapshot, line.robot, {.at = p.captured, .kind = PoseKind::smoothed},
                                    {.now = line.newest});
    ASSERT_TRUE(asked.pose);
    EXPECT_NEAR(p.pose.x, asked.pose->estimate.pose.x, 1e-9);
    EXPECT_NEAR(p.covariance(0, 0), asked.pose->estimate.covariance(0, 0), 1e-12);
  }
}

TEST(Trajectory, SmoothedLeavesOutWhenTheRobotWasLost) {
  std::vector<int> unseen(100);
  std::iota(unseen.begin(), unseen.end(), 50);  // ten seconds, of which five are carried over
  const RobotView anna = Line(250, unseen, Line::motion()).robot.view;
  const Trajectory whole = make_trajectory(anna, PoseKind::smoothed, Time{}, Time::max());
  for (const TrajectoryPoint& p : whole.points) EXPECT_NE(p.state, TrackState::lost);
  EXPECT_EQ(std::count_if(whole.points.begin(), whole.points.end(),
                          [](const auto& p) { return p.captured >= Line::at(160); }),
            90);
}

TEST(Trajectory, AMeasurementThatTheGateRefusedIsNotTheSourceOfAFilteredPose) {
  PoseHistory history;
  history.append({.captured = kStart,
                  .state = TrackState::predicting,
                  .measured = Observation{.captured = kStart, .source = PoseSource::align, .score = 0.9},
                  .filtered = Estimate{.at = kStart}});
  const auto whole = [&](PoseKind kind) {
    return make_trajectory({.id = "anna", .history = history.view(), .filter = nullptr}, kind, Time{},
                           Time::max())
        .points.at(0);
  };
  EXPECT_EQ(whole(PoseKind::filtered).source, PoseSource::prediction);
  EXPECT_EQ(whole(PoseKind::filtered).score, 0.0);
  EXPECT_EQ(whole(PoseKind::measured).source, PoseSource::align);
  EXPECT_EQ(whole(PoseKind::measured).score, 0.9);
}

TEST(Trajectory, AnEmptyOneIsAHeaderOrAnEmptyList) {
  const Trajectory empty{.robot = "anna", .kind = PoseKind::measured, .points = {}};
  EXPECT_THAT(written(empty, TrajectoryFormat::csv), HasSubstr("robot,captured"));
  EXPECT_EQ(written(empty, TrajectoryFormat::tum), "");
  EXPECT_EQ(Json::parse(written(empty, TrajectoryFormat::json))["points"], Json::array());
}

TEST(Trajectory, FormatsHaveNames) {
  EXPECT_EQ(trajectory_format("csv"), TrajectoryFormat::csv);
  EXPECT_EQ(trajectory_format("tum"), TrajectoryFormat::tum);
  EXPECT_EQ(trajectory_format("json"), TrajectoryFormat::json);
  EXPECT_EQ(trajectory_format("CSV"), std::nullopt);
  EXPECT_EQ(trajectory_format(""), std::nullopt);
}

}  // namespace
}  // namespace skylight::service::test
