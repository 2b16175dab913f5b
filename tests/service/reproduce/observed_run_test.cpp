#include "service/reproduce/observed_run.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "tests/service/simulated_room.hpp"

namespace skylight::service::reproduce {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

Observation observation(double x) {
  Observation seen;
  seen.captured = Time{Duration{1'700'000'000'123'456'789}};
  seen.pose = {x, 1.0 / 3.0, -3.1};
  // Values that no short decimal tells: each must come back to the bit.
  seen.covariance << 1e-300, 0.1, std::nextafter(1.0, 2.0), -0.0, 2.0 / 3.0, 5e-324, 7.0, 1e300, 0.3;
  seen.correlated << 1e-6, 1.0 / 7.0, 1e-9, 1.0 / 7.0, 2e-6, 0.0, 1e-9, 0.0, 1e-7;
  seen.source = PoseSource::homography;
  seen.camera = 2;
  seen.score = std::sqrt(0.5);
  seen.heading_turns = 4;
  return seen;
}

ObservedRun small_run() {
  ObservedRun run;
  run.route = "line-1";
  run.seed = std::numeric_limits<std::uint64_t>::max();
  run.frame_rate_hz = 10.0 / 3.0;
  run.width_px = 640;
  run.height_px = 480;
  run.variants = {"vertical", "ray"};
  run.frames.push_back({Time{Duration{1'700'000'000'123'456'789}},
                        {0.1, -2.0 / 7.0, M_PI},
                        true,
                        0.75,
                        {observation(0.1), std::nullopt}});
  run.frames.push_back({Time{Duration{-5}}, {0, 0, 0}, false, 1.0, {std::nullopt, observation(-1e-9)}});
  run.frames.push_back({Time{Duration{7}}, {0, 0, 0}, false, 0.0, {std::nullopt, std::nullopt}});
  run.odometry.push_back({Time{Duration{42}}, 0.22, -0.01, 1.0 / 9.0});
  return run;
}

void expect_same(const Observation& a, const Observation& b) {
  EXPECT_EQ(a.captured, b.captured);
  EXPECT_EQ(a.pose, b.pose);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.correlated, b.correlated);
  EXPECT_EQ(a.source, b.source);
  EXPECT_EQ(a.camera, b.camera);
  EXPECT_EQ(a.score, b.score);
  EXPECT_EQ(a.heading_turns, b.heading_turns);
}

void expect_same(const ObservedRun& a, const ObservedRun& b) {
  EXPECT_EQ(a.route, b.route);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.frame_rate_hz, b.frame_rate_hz);
  EXPECT_EQ(a.width_px, b.width_px);
  EXPECT_EQ(a.height_px, b.height_px);
  EXPECT_EQ(a.variants, b.variants);
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    EXPECT_EQ(a.frames[i].captured, b.frames[i].captured);
    EXPECT_EQ(a.frames[i].truth, b.frames[i].truth);
    EXPECT_EQ(a.frames[i].in_view, b.frames[i].in_view);
    EXPECT_EQ(a.frames[i].visible, b.frames[i].visible);
    ASSERT_EQ(a.frames[i].seen.size(), b.frames[i].seen.size());
    for (std::size_t v = 0; v < a.frames[i].seen.size(); ++v) {
      ASSERT_EQ(a.frames[i].seen[v].has_value(), b.frames[i].seen[v].has_value());
      if (a.frames[i].seen[v]) expect_same(*a.frames[i].seen[v], *b.frames[i].seen[v]);
    }
  }
  ASSERT_EQ(a.odometry.size(), b.odometry.size());
  for (std::size_t i = 0; i < a.odometry.size(); ++i) {
    EXPECT_EQ(a.odometry[i].at, b.odometry[i].at);
    EXPECT_EQ(a.odometry[i].forward, b.odometry[i].forward);
    EXPECT_EQ(a.odometry[i].sideways, b.odometry[i].sideways);
    EXPECT_EQ(a.odometry[i].yaw_rate, b.odometry[i].yaw_rate);
    EXPECT_EQ(a.odometry[i].covariance, b.odometry[i].covariance);
  }
}

std::string refusal(std::string_view text, std::string_view key = "key") {
  try {
    parse_run(text, key, "a.csv");
  } catch (const RunFileError& error) {
    return error.what();
  }
  return "taken";
}

class ObservedRunFile : public testing::Test {
 protected:
  test::RoomFolder folder_;
  std::filesystem::path path_ = folder_.path / "run.csv";
};

TEST_F(ObservedRunFile, ReadsBackToTheBit) {
  save_run(path_, small_run(), "key");
  expect_same(load_run(path_, "key"), small_run());
}

TEST_F(ObservedRunFile, ReadsBackARunWithoutFramesOrVariantsSeen) {
  ObservedRun run = small_run();
  run.frames.clear();
  run.odometry.clear();
  run.variants = {"ray"};
  save_run(path_, run, "key");
  expect_same(load_run(path_, "key"), run);
}

TEST(ObservedRunText, CutShortAnywhereIsRefusedWithItsLine) {
  const std::string whole = write_run(small_run(), "key");
  for (std::size_t length = 0; length < whole.size(); ++length)
    ASSERT_THAT(refusal(whole.substr(0, length)), StartsWith("a.csv:")) << length << " of " << whole.size();
}

TEST(ObservedRunText, OneByteChangedAnywhereIsRefused) {
  const std::string whole = write_run(small_run(), "key");
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = damaged[i] == '7' ? '8' : '7';
    ASSERT_THAT(refusal(damaged), StartsWith("a.csv:")) << "byte " << i;
  }
}

TEST(ObservedRunText, ErrorsNameTheLineAndWhatIsWrong) {
  const std::string whole = write_run(small_run(), "key");
  const auto replaced = [&](const std::string& what, const std::string& with) {
    std::string out = whole;
    return out.replace(out.find(what), what.size(), with);
  };
  EXPECT_EQ(refusal("x,y\n1,2\n"), "a.csv:1: title is \"x\", not \"skylight observed run\"");
  EXPECT_THAT(refusal(whole, "another key"), StartsWith("a.csv:1: key is "));
  EXPECT_EQ(refusal(replaced(",640,480", ",six,480")), "a.csv:3: width_px is no number: \"six\"");
  EXPECT_THAT(refusal(replaced("homography", "telescope")),
              StartsWith("a.csv:10: no such source: \"telescope\""));
  EXPECT_EQ(refusal(whole + "more\n"), "a.csv:13: more lines than there should be");
  // Refused before room is made for them.
  EXPECT_THAT(refusal(replaced("frames,3", "frames,99999999999")), HasSubstr("allowed 0 to 10000000"));
}

TEST_F(ObservedRunFile, IsMissedByItsName) {
  try {
    load_run(path_, "key");
    FAIL() << "there is none";
  } catch (const RunFileError& error) {
    EXPECT_EQ(error.what(), path_.string() + ": cannot be read");
  }
}

TEST_F(ObservedRunFile, WhatWasThereStaysWhereTheNewOneCannotBeWritten) {
  save_run(path_, small_run(), "key");
  std::filesystem::create_directory(path_.string() + ".part");  // in the way of the new one
  EXPECT_THROW(save_run(path_, ObservedRun{.route = "other"}, "key"), RunFileError);
  expect_same(load_run(path_, "key"), small_run());
}

TEST(ObservedRunText, NamesThatWouldBreakTheFileAreRefused) {
  ObservedRun run = small_run();
  run.route = "a,b";
  EXPECT_THROW(write_run(run, "key"), std::invalid_argument);
  run = small_run();
  run.variants[1] = "two\nlines";
  EXPECT_THROW(write_run(run, "key"), std::invalid_argument);
  run = small_run();
  run.frames[0].seen.pop_back();
  EXPECT_THROW(write_run(run, "key"), std::invalid_argument);
}

TEST(Fingerprint, IsFnv1a) {
  // From the authors' own list of test vectors (draft-eastlake-fnv, appendix C).
  EXPECT_EQ(fingerprint(""), "cbf29ce484222325");
  EXPECT_EQ(fingerprint("a"), "af63dc4c8601ec8c");
  EXPECT_EQ(fingerprint("foobar"), "85944171f73967e8");
}

}  // namespace
}  // namespace skylight::service::reproduce
