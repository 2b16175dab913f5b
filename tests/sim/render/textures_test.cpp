// Floors: what they promise to the sampler, and that they are the seed's.
#include "sim/render/textures.hpp"

#include <array>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sim/render/tags.hpp"

namespace skylight::sim {
namespace {

constexpr std::array kMaterials{FloorMaterial::plain, FloorMaterial::tiles, FloorMaterial::speckle,
                                FloorMaterial::concrete, FloorMaterial::wood};

RoomSpec room_with(FloorMaterial material) {
  RoomSpec room;
  room.size_m = {1.6, 1.2};
  room.floor.material = material;
  return room;
}

/// The whole floor at the texture's own resolution.
cv::Mat image_of(const FloorTexture& floor) {
  cv::Mat image(floor.texture.height_px(), floor.texture.width_px(), CV_8UC3);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      const Bgr color = floor.texture.sample(0, static_cast<float>(c), static_cast<float>(r));
      for (int k = 0; k < 3; ++k) image.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(color[k]);
    }
  }
  return image;
}

double difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total());
}

TEST(Floors, FollowFromTheirSeed) {
  for (const FloorMaterial material : kMaterials) {
    RoomSpec room = room_with(material);
    room.floor.cables = 3;
    const cv::Mat first = image_of(make_floor(room, 7, {}));
    EXPECT_EQ(difference(first, image_of(make_floor(room, 7, {}))), 0.0);
    EXPECT_GT(difference(first, image_of(make_floor(room, 8, {}))), 0.5);
  }
}

TEST(Floors, CoverTheRoomInItsColourOnTheMean) {
  for (const FloorMaterial material : kMaterials) {
    const RoomSpec room = room_with(material);
    const FloorTexture floor = make_floor(room, 3, {});
    EXPECT_GE(floor.texture.width_px() * floor.metres_per_px, 1.6 - 1e-9);
    EXPECT_GE(floor.texture.height_px() * floor.metres_per_px, 1.2 - 1e-9);
    const cv::Scalar mean = cv::mean(image_of(floor));
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(mean[k] / room.floor.color_rgb[static_cast<std::size_t>(2 - k)], 1.0, 0.12)
          << static_cast<int>(material);
  }
}

TEST(Floors, AreFlatWithoutContrast) {
  for (const FloorMaterial material : kMaterials) {
    RoomSpec room = room_with(material);
    room.floor.contrast = 0.0;
    cv::Mat mean;
    cv::Mat spread;
    cv::meanStdDev(image_of(make_floor(room, 3, {})), mean, spread);
    EXPECT_LT(cv::norm(spread, cv::NORM_INF), 0.5) << static_cast<int>(material);
  }
}

/// Every patterned floor has corners for a feature detector to be misled by.
TEST(Floors, InviteFalseMatches) {
  for (const FloorMaterial material :
       {FloorMaterial::tiles, FloorMaterial::speckle, FloorMaterial::concrete, FloorMaterial::wood}) {
    cv::Mat grey;
    cv::cvtColor(image_of(make_floor(room_with(material), 3, {})), grey, cv::COLOR_BGR2GRAY);
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(grey, corners, 2000, 0.05, 5);
    EXPECT_GT(corners.size(), 100U) << static_cast<int>(material);
  }
}

/// Columns (or rows) that are darker than all around, px.
std::vector<int> dark_lines(const cv::Mat& image, bool upright) {
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::Mat profile;
  cv::reduce(grey, profile, upright ? 0 : 1, cv::REDUCE_AVG, CV_32F);
  if (!upright) profile = profile.t();
  cv::Mat around;
  cv::blur(profile, around, {61, 1}, {-1, -1}, cv::BORDER_REFLECT);
  std::vector<int> lines;
  for (int i = 1; i + 1 < profile.cols; ++i) {
    const float here = profile.at<float>(i);
    const bool least = here <= profile.at<float>(i - 1) && here < profile.at<float>(i + 1);
    if (least && here < around.at<float>(i) - 8.0F) lines.push_back(i);
  }
  return lines;
}

TEST(Floors, HaveTilesOfTheirSizeWithAJointThroughTheMiddle) {
  RoomSpec room = room_with(FloorMaterial::tiles);
  room.floor.tile_m = 0.3;
  room.floor.contrast = 1.0;
  const cv::Mat image = image_of(make_floor(room, 3, {}));
  const std::vector<int> columns = dark_lines(image, true);
  ASSERT_EQ(columns.size(), 5U);  // at -0.6, -0.3, 0, 0.3 and 0.6 m
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const double x = (columns[i] - 0.5 * (image.cols - 1)) * 0.002;
    EXPECT_NEAR(x, -0.6 + 0.3 * static_cast<double>(i), 0.002);
  }
  EXPECT_EQ(dark_lines(image, false).size(), 3U);  // -0.3, 0 and 0.3 m
}

TEST(Floors, HavePlanksAlongXWhoseGrainRunsWithThem) {
  const cv::Mat image = image_of(make_floor(room_with(FloorMaterial::wood), 3, {}));
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F);
  const auto roughness = [&](int dx, int dy) {
    const cv::Rect part(0, 0, grey.cols - dx, grey.rows - dy);
    return cv::norm(grey(part), grey(part + cv::Point(dx, dy)), cv::NORM_L1);
  };
  EXPECT_GT(roughness(0, 3), 2.0 * roughness(3, 0));
}

TEST(Floors, HaveDarkCablesLyingOnThem) {
  RoomSpec room = room_with(FloorMaterial::plain);
  const cv::Mat without = image_of(make_floor(room, 5, {}));
  room.floor.cables = 4;
  const cv::Mat with = image_of(make_floor(room, 5, {}));
  cv::Mat dark;
  cv::inRange(with, cv::Scalar::all(0), cv::Scalar::all(60), dark);
  const double dark_m2 = cv::countNonZero(dark) * 4e-6;
  EXPECT_GT(dark_m2, 0.5 * 0.006);             // some of them run out of the room
  EXPECT_LT(dark_m2, 4 * 160 * 0.02 * 0.012);  // none longer or thicker than they may be
  cv::Mat lines;
  EXPECT_EQ(cv::connectedComponents(dark, lines) > 1, true);
  cv::Mat apart;
  cv::absdiff(with, without, apart);
  EXPECT_LT(cv::countNonZero(apart.reshape(1) > 0), 0.2 * 3.0 * static_cast<double>(with.total()));
}

class PictureFloor : public testing::Test {
 protected:
  PictureFloor() : folder_(testing::TempDir()) {
    cv::Mat picture(40, 60, CV_8UC3, cv::Scalar::all(200));
    picture({0, 0, 30, 20}).setTo(cv::Scalar(30, 60, 90));
    cv::imwrite((folder_ / "skylight_floor.png").string(), picture);
    room_ = room_with(FloorMaterial::picture);
    room_.floor.picture = "skylight_floor.png";
    room_.floor.picture_width_m = 0.6;
  }
  ~PictureFloor() override { std::filesystem::remove(folder_ / "skylight_floor.png"); }

  std::filesystem::path folder_;
  RoomSpec room_;
};

Bgr at(const FloorTexture& floor, double x, double y) {
  const double column = 0.5 * (floor.texture.width_px() - 1) + x / floor.metres_per_px;
  const double row = 0.5 * (floor.texture.height_px() - 1) - y / floor.metres_per_px;
  return floor.texture.sample(0, static_cast<float>(column), static_cast<float>(row));
}

TEST_F(PictureFloor, RepeatsFromTheRoomsMiddleWithAndWithoutCables) {
  for (const int cables : {0, 1}) {
    room_.floor.cables = cables;
    const FloorTexture floor = make_floor(room_, 1, folder_);
    int wrong = 0;
    for (double x = -0.75; x < 0.8; x += 0.06) {
      for (double y = -0.55; y < 0.6; y += 0.06) {
        const double u = std::fmod(x + 0.3 + 6.0, 0.6);  // in the picture, from its left
        const double v = std::fmod(0.2 - y + 4.0, 0.4);  // from its upper edge
        const Bgr expected = u < 0.3 && v < 0.2 ? Bgr(30, 60, 90) : Bgr(200, 200, 200);
        const bool near_edge = std::abs(u - 0.3) < 0.02 || std::abs(v - 0.2) < 0.02 || u < 0.02 || v < 0.02 ||
                               u > 0.58 || v > 0.38;
        if (!near_edge && (at(floor, x, y) - expected).norm() > 3.0F) ++wrong;
      }
    }
    EXPECT_LE(wrong, cables * 60);
  }
}

TEST(FloorTags, LieWhereAndAsTheyAreSaidTo) {
  RoomSpec room = room_with(FloorMaterial::plain);
  room.floor.tags = {{.id = 3, .size_m = 0.4, .x_m = 0.5, .y_m = -0.2, .yaw_deg = 90.0}};
  const FloorTexture floor = make_floor(room, 1, {});
  ASSERT_EQ(floor.prints.size(), 1U);
  const FloorPrint& print = floor.prints[0];
  EXPECT_NEAR(print.edge_m, 0.4 * 10 / 8, 1e-12) << "a ring of white around the black border";
  const cv::Mat cells = tag_pattern({.family = "36h11", .id = 3}, "tag").cells;
  for (int row = 0; row < 10; ++row) {
    for (int column = 0; column < 10; ++column) {
      // From the middle, right and up in the upright tag; a quarter turn takes right to up, up to left.
      const double right = 0.05 * (column - 4.5);
      const double up = 0.05 * (4.5 - row);
      const Eigen::Vector2d place(0.5 - up, -0.2 + right);
      ASSERT_TRUE(print.covers(place));
      EXPECT_NEAR(print.sample(place, 0.002)[0], cells.at<std::uint8_t>(row, column), 1.0)
          << row << ", " << column;
    }
  }
  EXPECT_FALSE(print.covers({0.5 + 0.26, -0.2}));
  room.floor.tags[0].id = 587;
  EXPECT_THROW(make_floor(room, 1, {}), std::invalid_argument);
}

}  // namespace
}  // namespace skylight::sim
