// The calibration's file: written, read, edited, kept and put back; and what the tracker gets of it.
#include <fstream>

#include <gmock/gmock.h>

#include "service/calibration/file.hpp"
#include "service/config.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

CalibrationFile hall() {
  CalibrationFile file;
  file.intrinsics = {.width_px = 1920,
                     .height_px = 1080,
                     .fx_px = 700.123456789012,
                     .fy_px = 701.0,
                     .cx_px = 958.5,
                     .cy_px = 541.25,
                     .distortion = {-0.045, 0.01, 0.0004, -0.0003, 0.0}};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << 0.1, -0.2, 3.9;
  pose.linear() =
      (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(3.1, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  file.map_from_camera = calibrated_pose(pose);
  Eigen::Matrix<double, kCameraParameters, kCameraParameters> a;
  for (Eigen::Index i = 0; i < a.size(); ++i) a.data()[i] = std::sin(1.0 + 7.0 * static_cast<double>(i * i));
  const Eigen::Matrix<double, kCameraParameters, 1> scale =
      (Eigen::Matrix<double, kCameraParameters, 1>() << 1, 1, 1, 1, 1e-3, 1e-3, 1e-4, 1e-4, 0, 2e-3, 2e-3,
       5e-3, 1e-3, 1e-3, 1e-3)
          .finished();
  set_uncertainty(file, {scale.asDiagonal() * a * a.transpose() * scale.asDiagonal()});
  file.intrinsics_made = CalibrationStep{.made = "2024-05-01T10:00:00Z",
                                         .from = "chessboard:9x6:0.025",
                                         .rms_px = 0.1,
                                         .sources = {{.name = "a.png", .error_px = 0.1},
                                                     {.name = "b.png", .used = false, .why_not = "blurred"}}};
  return file;
}

class CalibrationFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / (std::string("skylight_calibration_") +
                                              testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string refusal(const std::string& text) const {
    write("refused.json", text);
    try {
      read_calibration(folder_ / "refused.json");
    } catch (const settings::Error& error) {
      return error.what();
    }
    return "accepted";
  }

  fs::path folder_;
};

TEST_F(CalibrationFiles, ReadBackWhatWasWrittenToTheLastDigit) {
  CalibrationFile file = hall();
  file.note = R"(of the [old  lens], "sheets" [1, 2])";
  write_calibration(folder_ / "hall.json", file);
  const CalibrationFile again = read_calibration(folder_ / "hall.json");
  EXPECT_EQ(again.note, file.note);
  EXPECT_EQ(calibration_json(again), calibration_json(file));
  EXPECT_EQ(again.intrinsics.fx_px, file.intrinsics.fx_px);
  const auto told = uncertainty_of(again).covariance;
  EXPECT_LT((told - uncertainty_of(file).covariance).norm(), 1e-15 * told.norm());
  EXPECT_EQ(check(uncertainty_of(again)), "");
  EXPECT_EQ(again.intrinsics_made->sources.at(1).why_not, "blurred");
}

TEST_F(CalibrationFiles, MayBeEditedByHand) {
  const CalibrationFile least = [&] {
    write("least.json", R"({
      // measured with a ruler
      "format": 1,
      "intrinsics": {"width_px": 640, "height_px": 480, "fx_px": 500, "fy_px": 500, "cx_px": 320, "cy_px": 240},
      "map_from_camera": {"position_m": [0, 0, 3], "quaternion_xyzw": [1, 0, 0, 0]},
      "sigmas": {"focal_px": [5, 5], "position_m": [0.01, 0.01, 0.02]}
    })");
    return read_calibration(folder_ / "least.json");
  }();
  EXPECT_EQ(uncertainty_of(least).covariance(kFocalX, kFocalX), 25.0);
  EXPECT_EQ(uncertainty_of(least).covariance(kFocalX, kFocalY), 0.0);
  EXPECT_NEAR(camera_model(least).map_from_camera().translation().z(), 3.0, 1e-12);
}

TEST_F(CalibrationFiles, WrongOnesAreRefusedByLineAndKey) {
  const std::string lens =
      R"("intrinsics": {"width_px": 640, "height_px": 480, "fx_px": 500, "fy_px": 500, "cx_px": 320, "cy_px": 240})";
  EXPECT_THAT(refusal("{" + lens + "}"), HasSubstr("format"));
  EXPECT_THAT(refusal(R"({"format": 2, )" + lens + "}"), HasSubstr("format: 2 is out of range"));
  EXPECT_THAT(refusal(R"({"format": 1})"), HasSubstr("intrinsics"));
  EXPECT_THAT(refusal(R"({"format": 1, )" + lens + R"(, "correlations": [[1, 0], [0, 1]]})"),
              HasSubstr("15 rows"));
  EXPECT_THAT(refusal(R"({"format": 1, )" + lens + R"(, "sigmas": {"focal_px": [-1, 1]}})"),
              HasSubstr("sigmas.focal_px"));
  EXPECT_THAT(refusal(R"({"format": 1, )" + lens +
                      R"(, "map_from_camera": {"position_m": [0, 0, 1], "quaternion_xyzw": [1, 1, 0, 0]}})"),
              HasSubstr("of length 1"));
  CalibrationFile crooked = hall();
  crooked.correlations[0][1] = 0.9;
  crooked.correlations[1][0] = -0.9;
  EXPECT_THAT(refusal(calibration_json(crooked)), HasSubstr("not symmetric"));
}

TEST_F(CalibrationFiles, EarlierVersionsAreKeptAndPutBack) {
  const fs::path path = folder_ / "hall.json";
  CalibrationFile file = hall();
  for (const char* note : {"first", "second", "third"}) {
    file.note = note;
    write_calibration(path, file);
  }
  const auto versions = calibration_versions(path);
  ASSERT_EQ(versions.size(), 2U);
  EXPECT_EQ(read_calibration(versions[0].file).note, "first");
  EXPECT_EQ(restore_calibration(path, 1), 1);
  EXPECT_EQ(read_calibration(path).note, "first");
  EXPECT_EQ(restore_calibration(path, std::nullopt), 3);  // what restoring pushed aside
  EXPECT_EQ(read_calibration(path).note, "third");
  EXPECT_THAT([&] { restore_calibration(path, 9); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("no version 9")));
  write("hall.2.json", "{}");
  EXPECT_THROW(restore_calibration(path, 2), settings::Error);
  EXPECT_EQ(read_calibration(path).note, "third");
  EXPECT_THAT([&] { restore_calibration(folder_ / "other.json", 1); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("no versions")));
}

TEST_F(CalibrationFiles, GiveTheTrackerCameraAndFullCovariance) {
  write_calibration(folder_ / "hall.json", hall());
  write("my.json", R"({"cameras": [{"id": "a", "calibration": "hall.json"}]})");
  const Config config = load_config({.file = folder_ / "my.json"});
  const CameraModel camera = camera_model(config.cameras.at(0));
  EXPECT_EQ(camera.intrinsics().fx_px, hall().intrinsics.fx_px);
  EXPECT_LT((camera.map_from_camera().matrix() - pose_of(*hall().map_from_camera).matrix()).norm(), 1e-12);
  const auto calibration = tracker_config(config).calibration;
  ASSERT_EQ(calibration.size(), 1U);
  EXPECT_NE(calibration[0].covariance(kFocalX, kCameraPosition + 2), 0.0);
  EXPECT_LT((calibration[0].covariance - uncertainty_of(hall()).covariance).norm(), 1e-12);
}

TEST_F(CalibrationFiles, OfAConfigurationSayEverythingAlone) {
  write_calibration(folder_ / "hall.json", hall());
  const auto refused = [&](const std::string& camera) -> std::string {
    write("my.json", R"({"cameras": [{"id": "a", )" + camera + "}]}");
    try {
      load_config({.file = folder_ / "my.json"});
    } catch (const settings::Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refused(R"("calibration": "hall.json")"), "accepted");
  EXPECT_THAT(refused(R"("calibration": "hall.json", "overhead": {"height_m": 3})"),
              HasSubstr("calibration"));
  EXPECT_THAT(refused(R"("calibration": "hall.json", "uncertainty": {"focal_px": 1})"),
              HasSubstr("give only the file"));
  EXPECT_THAT(refused(R"("calibration": "none.json")"), HasSubstr("none.json"));
  CalibrationFile lens_only = hall();
  lens_only.map_from_camera.reset();
  write_calibration(folder_ / "lens.json", lens_only);
  EXPECT_THAT(refused(R"("calibration": "lens.json")"), HasSubstr("skylight calibrate extrinsics"));
}

TEST_F(CalibrationFiles, InTheFolderForThemCountInsteadOfWhatTheCameraSays) {
  const Intrinsics in = hall().intrinsics;
  const auto configured = [&](int width_px) {
    write("my.json", R"({"calibration_dir": "made", "cameras": [{"id": "hall", "overhead": {"height_m": 3,
        "metres_per_pixel": 0.005, "size_px": [)" +
                         std::to_string(width_px) + ", " + std::to_string(in.height_px) + R"(]}}]})");
    return load_config({.file = folder_ / "my.json"});
  };
  const Config without = configured(in.width_px);
  EXPECT_EQ(calibration_path(without, without.cameras.at(0)), folder_ / "made" / "hall.json");
  EXPECT_EQ(camera_model(without.cameras.at(0)).map_from_camera().translation().z(), 3.0);
  EXPECT_TRUE(tracker_config(without).calibration.empty());

  fs::create_directories(folder_ / "made");
  write_calibration(folder_ / "made" / "hall.json", hall());
  const Config with = configured(in.width_px);
  EXPECT_EQ(camera_model(with.cameras.at(0)).intrinsics().fx_px, in.fx_px);
  EXPECT_LT((tracker_config(with).calibration.at(0).covariance - uncertainty_of(hall()).covariance).norm(),
            1e-12);
  EXPECT_THAT([&] { configured(in.width_px + 1); },
              testing::ThrowsMessage<settings::Error>(testing::AllOf(
                  HasSubstr("made/hall.json"), HasSubstr(std::to_string(in.width_px + 1) + " x "))));
}

}  // namespace
}  // namespace skylight::service
