#include "service/reproduce/mrclam.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <variant>

#include <gmock/gmock.h>
#include <lzma.h>

#include "service/report/report.hpp"
#include "service/reproduce/xz.hpp"
#include "tests/service/simulated_room.hpp"
#include "tests/support/shared_data.hpp"

namespace skylight::service::reproduce {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kTruth = "# Time [s]    x [m]    y [m]    orientation [rad]\n";
constexpr const char* kOdometry = "# Time [s]    forward velocity [m/s]    angular velocity[rad/s]\n";

std::string packed(const std::string& text) {
  std::vector<std::uint8_t> out(lzma_stream_buffer_bound(text.size()));
  std::size_t size = 0;
  EXPECT_EQ(lzma_easy_buffer_encode(6, LZMA_CHECK_CRC64, nullptr,
                                    reinterpret_cast<const std::uint8_t*>(text.data()), text.size(),
                                    out.data(), &size, out.size()),
            LZMA_OK);
  return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)};
}

class MrclamFiles : public testing::Test {
 protected:
  void put(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path / name, std::ios::binary) << content;
  }
  void put_robot(int robot, const std::string& truth, const std::string& odometry) {
    const std::string stem = "Robot" + std::to_string(robot);
    put(stem + "_Groundtruth.dat.xz", packed(kTruth + truth));
    put(stem + "_Odometry.dat", kOdometry + odometry);
  }
  /// What is said of the first robot's files.
  std::string complaint() {
    try {
      read_mrclam_robot(folder_.path, 1);
    } catch (const MrclamError& error) {
      return error.what();
    }
    return "nothing";
  }

  service::test::RoomFolder folder_;
};

TEST_F(MrclamFiles, AreReadPackedAndPlain) {
  put_robot(1, "1248444187.100 \t 1.5 \t -2.25 \t 3.1\r\n\n1248444187.150 \t 1.6 \t -2.25 \t -3.1\n",
            "1248444187.125 \t  0.086 \t -0.398\n1248444187.125 \t 0.5 \t 0.5");
  const MrclamRobot robot = read_mrclam_robot(folder_.path, 1);
  ASSERT_EQ(robot.truth.size(), 2U);
  EXPECT_EQ(robot.truth[0].pose, (Pose2{1.5, -2.25, 3.1}));
  EXPECT_NEAR(to_seconds(robot.truth[1].at - robot.truth[0].at), 0.05, 1e-6);
  EXPECT_NEAR(to_seconds(robot.truth[0].at.time_since_epoch()), 1248444187.1, 1e-6);
  ASSERT_EQ(robot.odometry.size(), 1U);  // of two at the same time the first
  EXPECT_EQ(robot.odometry[0].forward, 0.086);
  EXPECT_EQ(robot.odometry[0].yaw_rate, -0.398);
  EXPECT_NEAR(to_seconds(robot.odometry[0].at - robot.truth[0].at), 0.025, 1e-6);
  EXPECT_THROW(read_mrclam_robot(folder_.path, 0), std::invalid_argument);
  EXPECT_THROW(read_mrclam_robot(folder_.path, 6), std::invalid_argument);
}

TEST_F(MrclamFiles, GiveTheTruthBetweenReadingsTheShortWayRoundAndNoneInHoles) {
  put_robot(1, "10.00 1 2 3.1\n10.05 2 4 -3.1\n10.20 2 4 -3.1\n", "10 0 0\n");
  const MrclamRobot robot = read_mrclam_robot(folder_.path, 1);
  const auto at = [&](double t) { return truth_at(robot, Time{from_seconds(t)}); };
  ASSERT_TRUE(at(10.025));
  EXPECT_NEAR(at(10.025)->x, 1.5, 1e-9);
  EXPECT_NEAR(at(10.025)->y, 3.0, 1e-9);
  EXPECT_NEAR(std::abs(at(10.025)->yaw), std::numbers::pi, 1e-9);
  EXPECT_TRUE(at(10.0));
  EXPECT_TRUE(at(10.2));
  EXPECT_FALSE(at(9.999));
  EXPECT_FALSE(at(10.1));  // 0.15 s without a reading
  EXPECT_FALSE(at(10.201));
}

TEST_F(MrclamFiles, ThatAreDamagedAreRefusedByFileAndLine) {
  const std::string good = "10.0 1 2 3\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {good + "10.1 1 x2 3\n", "Robot1_Groundtruth.dat.xz:3: y is no number: \"x2\""},
      {good + "\n10.1 1 2\n", "Robot1_Groundtruth.dat.xz:4: orientation is missing"},
      {good + "10.1 1 2 3 4\n", "Robot1_Groundtruth.dat.xz:3: more than 4 values: \"4\""},
      {good + "9.5 1 2 3\n", "Robot1_Groundtruth.dat.xz:3: time goes back by 0.500000 s"},
      {"10.0 nan 2 3\n", "Robot1_Groundtruth.dat.xz:2: x is no number: \"nan\""},
      {"10.0 1e999 2 3\n", "Robot1_Groundtruth.dat.xz:2: x is no number: \"1e999\""},
      {"-1 1 2 3\n", "Robot1_Groundtruth.dat.xz:2: time is not between 0 and 9e9 s"},
      {"", "Robot1_Groundtruth.dat.xz: holds no readings"}};
  for (const auto& [truth, told] : cases) {
    put_robot(1, truth, "10 0 0\n");
    EXPECT_EQ(complaint(), told);
  }
  put_robot(1, good, "10 0 0\n10.1 0.5\n");
  EXPECT_EQ(complaint(), "Robot1_Odometry.dat:3: angular velocity is missing");
}

TEST_F(MrclamFiles, ThatAreMissingOrBadlyPackedAreRefusedByName) {
  EXPECT_THAT(complaint(), HasSubstr("holds neither Robot1_Groundtruth.dat.xz nor Robot1_Groundtruth.dat"));
  std::string rows;
  for (int i = 0; i < 3000; ++i) rows += std::to_string(10.0 + 0.01 * i) + " 1 2 3\n";
  const std::string whole = packed(rows);
  const std::string name = "Robot1_Groundtruth.dat.xz";
  put(name, whole.substr(0, whole.size() / 2));
  EXPECT_EQ(complaint(), name + ": is cut short");
  put(name, "10 1 2 3\n10.1 1 2 3\n");
  EXPECT_EQ(complaint(), name + ": is not packed by xz");
  put(name, "");
  EXPECT_EQ(complaint(), name + ": is cut short");
  std::string bent = whole;
  bent[bent.size() / 2] = static_cast<char>(~bent[bent.size() / 2]);
  put(name, bent);
  EXPECT_THAT(complaint(), StartsWith(name + ": is damaged"));
  put(name, whole);
  EXPECT_THAT(complaint(), HasSubstr("holds neither Robot1_Odometry.dat.xz"));
  put("Robot1_Odometry.dat", "10 0 0\n");
  EXPECT_EQ(complaint(), "nothing");
}

/// Drives an arc at 0.3 m/s and says so, for so many seconds.
MrclamRobot made_robot(double seconds) {
  constexpr double kSpeed = 0.3;
  constexpr double kTurn = 0.2;
  MrclamRobot out{.robot = 1, .truth = {}, .odometry = {}};
  for (double t = 0.0; t <= seconds; t += 0.04) {
    const double yaw = kTurn * t;
    const Time at{from_seconds(1000.0 + t)};
    out.truth.push_back(
        {.at = at,
         .pose = {kSpeed / kTurn * std::sin(yaw), -kSpeed / kTurn * std::cos(yaw), wrap_angle(yaw)}});
    out.odometry.push_back({.at = at, .forward = kSpeed, .yaw_rate = kTurn});
  }
  return out;
}

struct Errors {
  std::vector<Eigen::Vector3d> of;  ///< one after the other; gaps and misses are left out
  std::vector<std::size_t> frame;
};

Errors errors_of(const MrclamRun& run) {
  Errors out;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const MrclamFrame& frame = run.frames[i];
    if (!frame.seen) continue;
    out.of.emplace_back(frame.seen->pose.x - frame.truth->x, frame.seen->pose.y - frame.truth->y,
                        wrap_angle(frame.seen->pose.yaw - frame.truth->yaw));
    out.frame.push_back(i);
  }
  return out;
}

TEST(MrclamNoiseAdded, IsOfTheStatedSizeAndLastsAsLongAsStated) {
  // Much slow noise, so that its correlation can be told from the white part.
  MrclamNoise noise{.white_m = 0.01, .white_rad = 0.03, .slow_m = 0.02, .slow_time_s = 2.0};
  const MrclamRun run = make_mrclam_run(made_robot(8000.0), noise);
  const Errors errors = errors_of(run);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double beside = 0.0;
  double later = 0.0;
  double pairs = 0.0;
  for (std::size_t i = 0; i < errors.of.size(); ++i) {
    squares += errors.of[i].cwiseAbs2() / static_cast<double>(errors.of.size());
    if (i < 20 || errors.frame[i] - errors.frame[i - 20] != 20) continue;
    pairs += 2.0;
    beside += errors.of[i].head<2>().dot(errors.of[i - 1].head<2>());
    later += errors.of[i].head<2>().dot(errors.of[i - 20].head<2>());
  }
  const double slow = noise.slow_m * noise.slow_m;
  const double white = noise.white_m * noise.white_m;
  EXPECT_NEAR(squares.x(), slow + white, 0.08 * (slow + white));
  EXPECT_NEAR(squares.y(), slow + white, 0.08 * (slow + white));
  EXPECT_NEAR(squares.z(), noise.white_rad * noise.white_rad, 0.03 * noise.white_rad * noise.white_rad);
  EXPECT_GT(pairs, 20000.0);
  EXPECT_NEAR(beside / pairs, slow * std::exp(-0.1 / 2.0), 0.1 * slow);
  EXPECT_NEAR(later / pairs, slow * std::exp(-1.0), 0.1 * slow);  // 2 s apart
  // And that is what the filters are told.
  const auto seen = run.frames.at(errors.frame.front()).seen;
  EXPECT_NEAR(seen->covariance(0, 0), slow + white, 1e-12);
  EXPECT_NEAR(seen->covariance(2, 2), noise.white_rad * noise.white_rad, 1e-12);
}

TEST(MrclamNoiseAdded, LeavesOutSingleFramesAndWholeGapsAsOftenAsStated) {
  const MrclamRun run = make_mrclam_run(made_robot(8000.0), {});
  std::size_t hidden = 0;
  std::size_t missed = 0;
  std::size_t gaps = 0;
  std::size_t length = 0;
  for (const MrclamFrame& frame : run.frames) {
    length = frame.in_gap ? length + 1 : 0;
    if (frame.in_gap) {
      ++hidden;
      EXPECT_FALSE(frame.seen);
    } else if (!frame.seen) {
      ++missed;
    }
    EXPECT_EQ(frame.ends_gap, length == 20);
    if (frame.ends_gap) ++gaps;
  }
  EXPECT_EQ(run.frames.size(), 80000U);
  EXPECT_NEAR(static_cast<double>(gaps), 400.0, 40.0);
  EXPECT_EQ(hidden, 20 * gaps);
  EXPECT_NEAR(static_cast<double>(missed) / static_cast<double>(run.frames.size() - hidden), 0.05, 0.004);
}

TEST(MrclamNoiseAdded, IsTheSameForTheSameSeedAloneAndRefusesWhatIsNoNoise) {
  const auto first = [](const MrclamRun& run) { return run.frames.at(0).seen->pose.x; };
  MrclamRobot other = made_robot(5.0);
  other.robot = 2;
  MrclamNoise noise{.single_miss = 0.0};
  const double x = first(make_mrclam_run(made_robot(5.0), noise));
  EXPECT_EQ(first(make_mrclam_run(made_robot(5.0), noise, 2.0)), x);
  EXPECT_NE(first(make_mrclam_run(other, noise)), x);
  noise.seed = 2;
  EXPECT_NE(first(make_mrclam_run(made_robot(5.0), noise)), x);
  EXPECT_EQ(make_mrclam_run(made_robot(5.0), noise, 2.0).frames.size(), 21U);
  EXPECT_THROW(make_mrclam_run(made_robot(5.0), {.white_m = 0.0}), std::invalid_argument);
  EXPECT_THROW(make_mrclam_run(made_robot(5.0), {.single_miss = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(make_mrclam_run(made_robot(5.0), {.gap_every_s = 2.0}), std::invalid_argument);
  EXPECT_THROW(make_mrclam_run(made_robot(5.0), {}, -1.0), std::invalid_argument);
}

TEST(MrclamCommands, LeadAndScaleAreFound) {
  // Turns by 0.8 of what it was told 0.2 s before, and drives as told.
  MrclamRobot robot{.robot = 1, .truth = {}, .odometry = {}};
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  for (int i = 0; i < 6000; ++i) {
    const double t = 0.01 * i;
    const double yaw = 0.5 * (1.0 - std::cos(t));
    const Time at{from_seconds(1000.0 + t)};
    robot.truth.push_back({.at = at, .pose = {place.x(), place.y(), wrap_angle(yaw)}});
    robot.odometry.push_back({.at = at, .forward = 0.2, .yaw_rate = 0.5 * std::sin(t + 0.2) / 0.8});
    place += 0.002 * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
  }
  const MrclamCommands commands = judge_commands(make_mrclam_run(robot, {}));
  EXPECT_NEAR(commands.lead_s, 0.2, 0.051);
  EXPECT_NEAR(commands.yaw_scale, 0.8, 0.02);
  EXPECT_NEAR(commands.forward_scale, 1.0, 0.01);
  EXPECT_EQ(judge_commands({}).yaw_scale, 0.0);
}

void expect_same(const RobotScore& a, const RobotScore& b) {
  EXPECT_EQ(a.frames, b.frames);
  EXPECT_EQ(a.position_error_m.mean, b.position_error_m.mean);
  EXPECT_EQ(a.yaw_error_rad.mean, b.yaw_error_rad.mean);
  EXPECT_EQ(a.nees_mean, b.nees_mean);
}

// Five robots on made files: what holds without the recording.
class MrclamMade : public MrclamFiles {
 protected:
  MrclamMade() {
    std::string truth;
    std::string odometry;
    for (const MrclamReading& reading : made_robot(30.0).truth) {
      const std::string time = std::to_string(to_seconds(reading.at.time_since_epoch()));
      truth += time + " " + std::to_string(reading.pose.x) + " " + std::to_string(reading.pose.y) + " " +
               std::to_string(reading.pose.yaw) + "\n";
      odometry += time + " 0.3 0.2\n";
    }
    for (int robot = 1; robot <= kMrclamRobots; ++robot) put_robot(robot, truth, odometry);
  }
};

TEST_F(MrclamMade, ResultsAreTheSameOnAnyNumberOfThreads) {
  const MrclamResults one = run_mrclam(folder_.path, {.seconds = 6.0, .threads = 1});
  const MrclamResults three = run_mrclam(folder_.path, {.seconds = 6.0, .threads = 3});
  ASSERT_EQ(one.robots.size(), 5U);
  ASSERT_EQ(three.robots.size(), 5U);
  for (std::size_t f = 0; f < kMrclamFilters; ++f) {
    expect_same(one.pooled.filters.at(f).all, three.pooled.filters.at(f).all);
    expect_same(one.pooled.filters.at(f).smoothed, three.pooled.filters.at(f).smoothed);
    expect_same(one.pooled.filters.at(f).one_ahead, three.pooled.filters.at(f).one_ahead);
  }
}

TEST_F(MrclamMade, OdometryThatIsTrueCarriesThroughGapsAndAhead) {
  const MrclamResults results = run_mrclam(folder_.path, {.noise = {.gap_every_s = 8.0}});
  EXPECT_NEAR(results.seconds, 5 * 30.0, 1.0);
  EXPECT_GT(results.pooled.moving, 0.99);
  const MrclamScore& without = results.pooled.filters[kMotion];
  const MrclamScore& with = results.pooled.filters[kMotionOdometry];
  EXPECT_GE(with.gap_end.frames, 5U);
  EXPECT_LT(with.gap_end.position_error_m.mean, without.gap_end.position_error_m.mean);
  EXPECT_LT(with.one_ahead.position_error_m.mean, without.one_ahead.position_error_m.mean);
  EXPECT_EQ(with.all.availability, 1.0);
  // Each frame that is old enough is smoothed once; those of gaps are not judged.
  EXPECT_LE(with.smoothed.frames, with.filtered.frames);
  EXPECT_GE(with.smoothed.frames + 5U * 16U, with.filtered.frames);
  EXPECT_EQ(results.pooled.filters[kWindow].smoothed.frames, 0U);
}

TEST_F(MrclamMade, SectionIsAPageWithOneTableAndTwoPlots) {
  const MrclamResults results = run_mrclam(folder_.path, {.noise = {.gap_every_s = 8.0}, .seconds = 15.0});
  const report::Section section = mrclam_section(results);
  const report::Document document{.title = "Real robots", .sections = {section}};
  EXPECT_NO_THROW(report::check(document));
  std::vector<const report::Plot*> plots;
  for (const report::Block& block : section.blocks) {
    if (const auto* table = std::get_if<report::Table>(&block)) {
      EXPECT_EQ(table->rows.size(), 6U * 5U);
    }
    if (const auto* plot = std::get_if<report::Plot>(&block)) plots.push_back(plot);
  }
  ASSERT_EQ(plots.size(), 2U);
  EXPECT_EQ(plots[0]->series.front().x.size(), 151U);  // all there is
  EXPECT_EQ(plots[1]->series.front().x.size(), 80U);   // 3 s before, 2 s, 3 s after
  EXPECT_THAT(report::html(document), HasSubstr("commanded to have"));
  EXPECT_NO_THROW(report::check(report::Document{.title = "None", .sections = {mrclam_section({})}}));
}

// The recording itself.
class MrclamRecording : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = skylight::test::shared_data("trajectories/mrclam6");
    if (!folder_) GTEST_SKIP() << "shared data is absent: trajectories/mrclam6";
  }
  static double mean(const RobotScore& score) { return score.position_error_m.mean; }
  std::optional<std::filesystem::path> folder_;
};

TEST_F(MrclamRecording, SmoothedIsBetterThanFilteredAndThatThanMeasuredAndOdometryDoesNoHarm) {
  const MrclamResults results = run_mrclam(*folder_, {.noise = {.gap_every_s = 8.0}, .seconds = 30.0});
  const MrclamScore& window = results.pooled.filters[kWindow];
  const MrclamScore& without = results.pooled.filters[kMotion];
  const MrclamScore& with = results.pooled.filters[kMotionOdometry];
  EXPECT_GT(results.pooled.moving, 0.5);
  for (const MrclamScore* one : {&without, &with}) {
    EXPECT_LT(1.5 * mean(one->filtered), mean(results.pooled.measured));
    EXPECT_LT(1.1 * mean(one->smoothed), mean(one->filtered));
    EXPECT_LT(mean(one->filtered), mean(window.filtered));
    EXPECT_LT(mean(one->half_ahead), mean(one->one_ahead));
    EXPECT_LT(mean(one->gap_end), mean(window.gap_end));
    EXPECT_GT(one->all.availability, 0.999);
    EXPECT_EQ(one->all.confident_wrong, 0U);
  }
  // Where it is seen, odometry has little to add.
  EXPECT_LE(mean(with.filtered), 1.02 * mean(without.filtered));
  EXPECT_LE(mean(with.all), mean(without.all));
  EXPECT_LT(mean(with.one_ahead), mean(without.one_ahead));
  EXPECT_LT(mean(with.gap_end), mean(without.gap_end));
  EXPECT_GE(with.gap_end.frames, 10U);
  // A slow error that it is told of is in what it claims.
  const RobotScore& told = results.pooled.filters[kMotionTold].filtered;
  EXPECT_NEAR(told.nees_mean, 3.0, 0.8);
  EXPECT_GT(told.ellipse_95, 0.93);
}

TEST_F(MrclamRecording, ADetectorOfAMillimetreIsNotMadeWorse) {
  const MrclamNoise fine{.white_m = 0.001, .white_rad = 0.0035, .slow_m = 0.0};
  const MrclamResults results = run_mrclam(*folder_, {.noise = fine, .seconds = 10.0});
  const MrclamScores& pooled = results.pooled;
  EXPECT_NEAR(mean(pooled.measured), 0.001 * std::sqrt(std::numbers::pi / 2.0), 1e-4);  // Rayleigh's mean
  EXPECT_LT(mean(pooled.filters[kMotion].filtered), mean(pooled.measured));
  EXPECT_GT(pooled.filters[kMotion].filtered.ellipse_95, 0.88);
}

}  // namespace
}  // namespace skylight::service::reproduce
