// Tags drawn by the test itself, and corners that are known exactly.
#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "tests/support/flat_scene.hpp"
#include "tracker/detect/tag_pose.hpp"

namespace skylight {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Each cell `cell_px` wide, the first at (`left`, `top`), on grey.
cv::Mat sheet(const TagPattern& pattern, int cell_px, const cv::Point& at,
              const cv::Size& size = {200, 160}) {
  cv::Mat image(size, CV_8UC1, cv::Scalar(170));
  for (int r = 0; r < pattern.cells.rows; ++r) {
    for (int c = 0; c < pattern.cells.cols; ++c) {
      const cv::Rect cell(at.x + c * cell_px, at.y + r * cell_px, cell_px, cell_px);
      cv::rectangle(image, cell, pattern.cells.at<std::uint8_t>(r, c) != 0 ? 230 : 25, cv::FILLED);
    }
  }
  return image;
}

std::vector<FoundTag> find_all(const TagFinder& finder, const cv::Mat& image, double edge_px) {
  return finder.find(image, {cv::Rect({}, image.size()), edge_px});
}

TEST(TagFinder, SaysWhereTheCornersAreByOurPixels) {
  // 36h11: a white rim of one cell, then eight cells: the black border begins with the pixel 30 + 4, whose
  // left edge is at 33.5, and ends with the pixel 30 + 36 - 1, whose right edge is at 65.5.
  const cv::Mat image = sheet(tag_pattern("36h11", 17), 4, {30, 50});
  const auto found = find_all(TagFinder({"36h11"}), image, 32.0);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].id, 17);
  EXPECT_EQ(found[0].family, "36h11");
  EXPECT_EQ(found[0].hamming, 0);
  const TagCorners expected{Pixel(33.5, 53.5), Pixel(65.5, 53.5), Pixel(65.5, 85.5), Pixel(33.5, 85.5)};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((found[0].corners_px[i] - expected[i]).norm(), 0.02) << i;
    EXPECT_LT((found[0].quad_px[i] - expected[i]).norm(), 0.5) << i;
  }
}

TEST(TagFinder, NamesTheCornersOfTheUprightTagHoweverItIsTurned) {
  cv::Mat image = sheet(tag_pattern("25h9", 3), 5, {40, 30}, {160, 160});
  const TagFinder finder({"25h9"});
  const auto upright = find_all(finder, image, 30.0);
  ASSERT_EQ(upright.size(), 1U);
  cv::rotate(image, image, cv::ROTATE_90_CLOCKWISE);  // (x, y) goes to (159 - y, x)
  const auto turned = find_all(finder, image, 30.0);
  ASSERT_EQ(turned.size(), 1U);
  for (std::size_t i = 0; i < 4; ++i) {
    const Pixel& before = upright[0].corners_px[i];
    EXPECT_LT((turned[0].corners_px[i] - Pixel(159.0 - before.y(), before.x())).norm(), 0.05) << i;
  }
}

TEST(TagFinder, FindsTheTagsOfAllItsFamiliesInOnePass) {
  cv::Mat image = sheet(tag_pattern("36h11", 5), 5, {10, 10}, {260, 200});
  const auto add = [&](const TagPattern& pattern, const cv::Point& at) {
    const int side = pattern.cells.cols * 5;
    sheet(pattern, 5, {0, 0}, {side, side}).copyTo(image(cv::Rect(at, cv::Size(side, side))));
  };
  add(tag_pattern("25h9", 6), {80, 20});
  add(tag_pattern("16h5", 7), {160, 30});
  add(tag_pattern("Standard41h12", 2000), {90, 110});
  const auto found = find_all(TagFinder({"36h11", "25h9", "16h5", "Standard41h12"}), image, 25.0);
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[0].id, 7);  // by family, then id
  EXPECT_EQ(found[1].id, 6);
  EXPECT_EQ(found[2].id, 5);
  EXPECT_EQ(found[3].id, 2000);
}

TEST(TagFinder, CorrectsNoMoreBitsThanItMay) {
  const auto with_wrong_bits = [](int bits) {
    TagPattern pattern = tag_pattern("36h11", 9);
    for (int i = 0; i < bits; ++i) {
      auto& cell = pattern.cells.at<std::uint8_t>(3 + i, 4);
      cell = cell == 0 ? 255 : 0;
    }
    return sheet(pattern, 5, {40, 40});
  };
  for (int allowed = 0; allowed <= 2; ++allowed) {
    const TagFinder finder({"36h11"}, {.max_hamming = allowed});
    for (int wrong = 0; wrong <= 3; ++wrong) {
      const auto found = find_all(finder, with_wrong_bits(wrong), 40.0);
      ASSERT_EQ(found.size(), wrong <= allowed ? 1U : 0U) << wrong << " of " << allowed;
      EXPECT_EQ(found.empty() ? wrong : found[0].hamming, wrong);
    }
  }
}

TEST(TagFinder, DoesNotTakeAMirroredTagForATag) {
  cv::Mat image = sheet(tag_pattern("36h11", 9), 5, {40, 40});
  cv::flip(image, image, 1);
  EXPECT_TRUE(find_all(TagFinder({"36h11"}), image, 40.0).empty());
}

TEST(TagFinder, HoldsWhateverPartItIsAskedFor) {
  const cv::Mat image = sheet(tag_pattern("36h11", 17), 4, {30, 50});
  const TagFinder finder({"36h11"});
  EXPECT_TRUE(finder.find(image, {cv::Rect(), 30.0}).empty());
  EXPECT_TRUE(finder.find(image, {cv::Rect(500, 500, 50, 50), 30.0}).empty());
  EXPECT_TRUE(finder.find(image, {cv::Rect(0, 0, 7, 100), 30.0}).empty());
  EXPECT_TRUE(finder.find(image, {cv::Rect(0, 0, 200, 160), 0.0}).empty());
  EXPECT_TRUE(finder.find(cv::Mat(), {cv::Rect(0, 0, 200, 160), 30.0}).empty());
  for (int side = 8; side < 40; ++side) finder.find(image, {cv::Rect(28, 48, side, side), 6.0});
  for (int left = 0; left < 70; left += 3) {
    const auto cut = finder.find(image, {cv::Rect(left, 40, 60, 60), 30.0});
    if (cut.empty()) continue;
    EXPECT_LT((cut[0].corners_px[0] - Pixel(33.5, 53.5)).norm(), 0.03) << left;
  }
  EXPECT_EQ(finder.find(image, {cv::Rect(-50, -50, 500, 500), 30.0}).size(), 1U);
}

TEST(TagFinder, GivesTheSameAnswersToManyThreadsAtATime) {
  std::vector<cv::Mat> images;
  std::vector<TagCorners> alone(12);
  const TagFinder finder({"36h11", "16h5"});
  for (int i = 0; i < 12; ++i) images.push_back(sheet(tag_pattern("36h11", i), 3, {20 + 5 * i, 30 + 3 * i}));
  for (std::size_t i = 0; i < 12; ++i) {
    const auto found = find_all(finder, images[i], 12.0);
    ASSERT_EQ(found.size(), 1U);
    alone[i] = found[0].corners_px;
  }
  std::vector<std::thread> threads;
  std::array<bool, 12> same{};
  for (std::size_t i = 0; i < 12; ++i) {
    threads.emplace_back([&, i] {
      const auto found = find_all(finder, images[i], 12.0);
      same[i] = found.size() == 1 && found[0].id == static_cast<int>(i) && found[0].corners_px == alone[i];
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(same, testing::Each(true));
}

TEST(TagFinder, RefusesWhatThereIsNotNamingWhatThereIs) {
  const auto refused = [](const std::vector<std::string>& families, const TagFinderConfig& config = {}) {
    try {
      const TagFinder finder(families, config);
      return std::string("accepted");
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
  };
  EXPECT_THAT(refused({}), testing::HasSubstr("needs a family"));
  EXPECT_EQ(refused({"36h11", "99h9"}), "family is '99h9', allowed: 36h11 25h9 16h5 Standard41h12");
  EXPECT_THAT(refused({"36h11"}, {.max_hamming = 3}), testing::HasSubstr("allowed 0 to 2"));
  EXPECT_THAT(refused({"36h11"}, {.min_score = 1.5}), testing::HasSubstr("allowed 0 to 1"));
}

TEST(TagSpec, IsCheckedNamingFieldValueAndRange) {
  EXPECT_EQ(check(TagSpec{}), "");
  EXPECT_EQ(check(TagSpec{.id = 587}), "id is 587, allowed 0 to 586 in the family 36h11");
  EXPECT_EQ(check(TagSpec{.family = "16h5", .id = 30}), "id is 30, allowed 0 to 29 in the family 16h5");
  EXPECT_THAT(check(TagSpec{.family = "tag36h11"}), testing::HasSubstr("allowed: 36h11"));
  EXPECT_THAT(check(TagSpec{.size_m = 0.0}), testing::HasSubstr("size_m"));
  EXPECT_THAT(check(TagSpec{.size_m = std::nan("")}), testing::HasSubstr("size_m"));
  EXPECT_THAT(check(TagSpec{.height_m = 6.0}), testing::HasSubstr("height_m"));
  EXPECT_THAT(check(TagSpec{.mounting = {0, 9, 0}}), testing::HasSubstr("mounting.y"));
  EXPECT_THAT(check(TagSpec{.mounting = {0, 0, 90}}), testing::HasSubstr("mounting.yaw"));
  EXPECT_THROW(tag_pattern("36h11", -1), std::invalid_argument);
  EXPECT_EQ(tag_count("36h11"), 587);
  EXPECT_EQ(tag_count("none"), 0);
}

// A tilted camera with a strong lens.
CameraModel slanted(LensModel lens) {
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  map_from_camera.linear() = (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) *
                              Eigen::AngleAxisd(std::numbers::pi - 0.2, Eigen::Vector3d::UnitX()) *
                              Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))
                                 .toRotationMatrix();
  map_from_camera.translation() << 0.4, -0.3, 3.0;
  Intrinsics in{.width_px = 1280,
                .height_px = 960,
                .fx_px = 620,
                .fy_px = 630,
                .cx_px = 650,
                .cy_px = 470,
                .lens = lens,
                .distortion = {-0.2, 0.05, 0.001, -0.002, 0.0}};
  if (lens == LensModel::kannala_brandt) in.distortion = {-0.03, 0.004, 0, 0, 0};
  return CameraModel(in, map_from_camera);
}

const TagSpec kMounted{.id = 4, .size_m = 0.1, .height_m = 0.2, .mounting = {0.06, -0.03, 0.8}};

// What an exact detector would see of a robot at this pose; corners worked out here, one by one.
FoundTag seen(const CameraModel& camera, const TagSpec& tag, const Pose2& pose, double raised_m = 0.0,
              double tilt = 0.0) {
  FoundTag found{.family = "36h11", .id = tag.id, .score = 1.0};
  const double half = 0.5 * tag.size_m;
  const std::array<Eigen::Vector3d, 4> corners{
      Eigen::Vector3d(half, half, 0), Eigen::Vector3d(half, -half, 0), Eigen::Vector3d(-half, -half, 0),
      Eigen::Vector3d(-half, half, 0)};
  const Eigen::Isometry3d map_from_tag =
      Eigen::Translation3d(pose.x, pose.y, 0) * Eigen::AngleAxisd(pose.yaw, Eigen::Vector3d::UnitZ()) *
      Eigen::Translation3d(tag.mounting.x, tag.mounting.y, tag.height_m + raised_m) *
      Eigen::AngleAxisd(tag.mounting.yaw, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX());
  for (std::size_t i = 0; i < 4; ++i)
    found.corners_px[i] = camera.pixel_from_map(map_from_tag * corners[i]).value();
  found.covariance = 0.02 * 0.02 * Eigen::Matrix<double, 8, 8>::Identity();
  return found;
}

TEST(TagPose, IsExactFromExactCornersThroughAnyLens) {
  for (const LensModel lens : {LensModel::brown_conrady, LensModel::kannala_brandt}) {
    const CameraModel camera = slanted(lens);
    for (const Pose2 pose : {Pose2{0.2, 0.1, 0.3}, Pose2{-0.9, 0.6, -2.9}, Pose2{1.1, -0.8, 1.6}}) {
      const TagAnswer answer = tag_pose(seen(camera, kMounted, pose), kMounted, camera);
      ASSERT_TRUE(answer.pose) << answer.refused;
      EXPECT_NEAR(answer.pose->pose.x, pose.x, 1e-9);
      EXPECT_NEAR(answer.pose->pose.y, pose.y, 1e-9);
      EXPECT_NEAR(wrap_angle(answer.pose->pose.yaw - pose.yaw), 0.0, 1e-8);
      EXPECT_NEAR(answer.pose->size_ratio, 1.0, 1e-3);
      EXPECT_LT(answer.pose->misfit_px, 1e-6);
    }
  }
}

TEST(TagPose, ItsCovarianceIsThatOfManyNoisyPictures) {
  const CameraModel camera = slanted(LensModel::brown_conrady);
  const Pose2 pose{0.7, 0.5, 2.0};
  const FoundTag exact = seen(camera, kMounted, pose);
  std::mt19937 random(3);
  // Twelve uniform numbers less six: normal enough, and the same everywhere.
  const auto normal = [&] {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(random()) / 4294967296.0;
    return sum;
  };
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Covariance3 claimed = Covariance3::Zero();
  constexpr int kPictures = 4000;
  for (int i = 0; i < kPictures; ++i) {
    FoundTag noisy = exact;
    for (Pixel& corner : noisy.corners_px) corner += 0.02 * Pixel(normal(), normal());
    const TagAnswer answer = tag_pose(noisy, kMounted, camera);
    ASSERT_TRUE(answer.pose);
    const Eigen::Vector3d error(answer.pose->pose.x - pose.x, answer.pose->pose.y - pose.y,
                                wrap_angle(answer.pose->pose.yaw - pose.yaw));
    spread += error * error.transpose() / kPictures;
    claimed += answer.pose->covariance / kPictures;
  }
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double scale = std::sqrt(claimed(i, i) * claimed(k, k));
      EXPECT_NEAR(spread(i, k) / scale, claimed(i, k) / scale, 0.08) << i << k;
    }
  }
}

TEST(TagPose, GrowsItsCovarianceWhereTheCornersFitWorseThanTheyClaim) {
  const CameraModel camera = slanted(LensModel::brown_conrady);
  FoundTag found = seen(camera, kMounted, {0.2, 0.1, 0.3});
  const double before = tag_pose(found, kMounted, camera).pose->covariance(0, 0);
  found.corners_px[2] += Pixel(0.3, -0.2);
  const TagAnswer bent = tag_pose(found, kMounted, camera);
  ASSERT_TRUE(bent.pose) << bent.refused;
  EXPECT_GT(bent.pose->covariance(0, 0), 3.0 * before);
}

TEST(TagPose, RefusesATagOfAnotherSizeOneThatIsHeldUpAndOneThatIsTilted) {
  const CameraModel camera = slanted(LensModel::brown_conrady);
  const Pose2 pose{0.2, 0.1, 0.3};
  TagSpec bigger = kMounted;
  bigger.size_m *= 1.2;
  EXPECT_THAT(std::string(tag_pose(seen(camera, bigger, pose), kMounted, camera).refused),
              testing::HasSubstr("another size"));
  EXPECT_THAT(std::string(tag_pose(seen(camera, kMounted, pose, 0.8), kMounted, camera).refused),
              testing::HasSubstr("another size"));
  // Tilted by 35 degrees it is as long as ever and 18 % narrower: bent, and within 10 % of the size.
  const TagAnswer tilted =
      tag_pose(seen(camera, kMounted, pose, 0.0, 35 * kDegree), kMounted, camera, {.max_size_error = 0.2});
  EXPECT_THAT(std::string(tilted.refused), testing::HasSubstr("does not lie flat"));
  EXPECT_TRUE(tag_pose(seen(camera, kMounted, pose, 0.02, 3 * kDegree), kMounted, camera).pose);
}

}  // namespace
}  // namespace skylight
