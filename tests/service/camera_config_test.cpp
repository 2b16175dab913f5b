// How well a camera is known, from its configuration to the tracker.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight::service {
namespace {

using testing::HasSubstr;

const std::string kPlaces =
    R"("overhead": {"height_m": 3.0, "metres_per_pixel": 0.004, "size_px": [640, 480]})";

Config with_cameras(const std::string& cameras) {
  return settings::read<Config>(settings::parse("{\"cameras\": [" + cameras + "]}", "my.json"));
}

TEST(CameraConfig, WithoutUncertaintyIsKnownExactly) {
  EXPECT_TRUE(tracker_config(with_cameras(R"({"id": "a", )" + kPlaces + "}")).calibration.empty());
  EXPECT_TRUE(tracker_config({}).calibration.empty());
}

TEST(CameraConfig, GivesTheTrackerAnUncertaintyForEachCamera) {
  const Config config =
      with_cameras(R"({"id": "a", )" + kPlaces + R"(}, {"id": "b", )" + kPlaces +
                   R"(, "uncertainty": {"focal_px": 2, "distortion": [0.01, 0.02], "rotation_rad": 0.001}})");
  const auto calibration = tracker_config(config).calibration;
  ASSERT_EQ(calibration.size(), 2U);
  EXPECT_EQ(calibration[0].covariance.norm(), 0.0);
  CameraParameters sigma = CameraParameters::Zero();
  sigma[kFocalX] = sigma[kFocalY] = 2.0;
  sigma[kDistortion] = 0.01;
  sigma[kDistortion + 1] = 0.02;
  sigma.segment<3>(kCameraRotation).setConstant(0.001);
  EXPECT_LT((calibration[1].covariance.diagonal().cwiseSqrt() - sigma).norm(), 1e-15);
  // ... and as a file it is the same again.
  const Config again = settings::read<Config>(settings::parse(config_json(config), "again.json"));
  EXPECT_FALSE(again.cameras[0].uncertainty);
  EXPECT_EQ(again.cameras[1].uncertainty, config.cameras[1].uncertainty);
}

TEST(CameraConfig, AnUncertaintyOutOfRangeIsRefusedByItsKey) {
  const auto refusal = [](const std::string& uncertainty) -> std::string {
    try {
      with_cameras(R"({"id": "a", )" + kPlaces + R"(, "uncertainty": {)" + uncertainty + "}}");
    } catch (const settings::Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(R"("position_m": -0.1)"), HasSubstr("cameras[0].uncertainty.position_m"));
  EXPECT_THAT(refusal(R"("position_m": -0.1)"), HasSubstr("-0.1"));
  EXPECT_THAT(refusal(R"("distortion": [0, 0, 0, 0, 0, 0])"), HasSubstr("cameras[0].uncertainty.distortion"));
  EXPECT_THAT(refusal(R"("rotation_deg": 1)"), HasSubstr("rotation_deg"));
}

}  // namespace
}  // namespace skylight::service
