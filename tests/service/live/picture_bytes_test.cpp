// Pictures off a wire, judged by the picture that was encoded and by the layouts' definitions.
#include "service/sources/live/picture_bytes.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "service/sources/source.hpp"
#include "tests/service/live/scripted_driver.hpp"

namespace skylight::service::test {
namespace {

using testing::HasSubstr;
using Bytes = std::vector<unsigned char>;

Bytes encoded(const char* extension, const cv::Mat& image) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes));
  return bytes;
}

std::string refusal(const Bytes& bytes, cv::Size size) {
  try {
    decode_picture(bytes, size);
  } catch (const SourceError& error) {
    return error.what();
  }
  return "taken";
}

TEST(PictureBytes, TheSizeStandsInTheHead) {
  const cv::Mat image = noisy_picture(1, {60, 40});
  EXPECT_EQ(stated_size(encoded(".png", image)), cv::Size(60, 40));
  EXPECT_EQ(stated_size(encoded(".jpg", image)), cv::Size(60, 40));
  EXPECT_EQ(stated_size(encoded(".bmp", image)), std::nullopt);
  Bytes bytes = encoded(".jpg", image);
  for (std::size_t length = 0; length < 30; ++length) stated_size({bytes.data(), length});  // and no crash
  EXPECT_EQ(stated_size(Bytes{}), std::nullopt);
}

TEST(PictureBytes, APngComesBackToTheBitAndAGreyOneStaysGrey) {
  const cv::Mat image = noisy_picture(1, {60, 40});
  EXPECT_EQ(cv::norm(decode_picture(encoded(".png", image), {60, 40}), image, cv::NORM_INF), 0.0);
  const cv::Mat grey(40, 60, CV_8UC1, cv::Scalar(77));
  EXPECT_EQ(decode_picture(encoded(".png", grey), {60, 40}).type(), CV_8UC1);
}

TEST(PictureBytes, WhatIsNoSuchPictureIsRefusedWithTheReason) {
  const Bytes good = encoded(".png", noisy_picture(1, {60, 40}));
  EXPECT_THAT(refusal(good, {640, 480}), testing::AllOf(HasSubstr("60 x 40"), HasSubstr("640 x 480")));
  EXPECT_THAT(refusal(Bytes(100, 7), {60, 40}), HasSubstr("no JPEG or PNG"));
  EXPECT_THAT(refusal({}, {60, 40}), HasSubstr("no JPEG or PNG"));
  EXPECT_THAT(refusal({good.begin(), good.begin() + 40}, {60, 40}), HasSubstr("damaged"));
  Bytes huge = good;  // a head that claims 2^31 x 2^31 is refused by it alone
  for (std::size_t i = 16; i < 24; ++i) huge[i] = 0x7f;
  EXPECT_THAT(refusal(huge, {60, 40}), HasSubstr("calibrated for 60 x 40"));
}

/// ITU-R BT.601 with 8 bits, as V4L2's YUV formats mean it: Y 16 to 235, U and V about 128.
void expect_red(const cv::Mat& image, const std::string& what) {
  ASSERT_EQ(image.type(), CV_8UC3) << what;
  EXPECT_LT(cv::norm(image.at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 254), cv::NORM_INF), 4) << what;
}

TEST(PictureBytes, RawLayoutsBecomeBgr) {
  constexpr unsigned char kY = 81, kU = 90, kV = 240;  // red, BT.601
  const cv::Size size(4, 2);
  Bytes yuyv, uyvy;
  for (int i = 0; i < 4; ++i) {
    yuyv.insert(yuyv.end(), {kY, kU, kY, kV});
    uyvy.insert(uyvy.end(), {kU, kY, kV, kY});
  }
  Bytes nv12(8, kY);
  nv12.insert(nv12.end(), {kU, kV, kU, kV});
  expect_red(decode_raw(yuyv, PixelFormat::yuyv, size, 0), "YUYV");
  expect_red(decode_raw(uyvy, PixelFormat::uyvy, size, 8), "UYVY");
  expect_red(decode_raw(nv12, PixelFormat::nv12, size, 4), "NV12");
  Bytes rgb, bgr;
  for (int i = 0; i < 8; ++i) {
    rgb.insert(rgb.end(), {254, 0, 0});
    bgr.insert(bgr.end(), {0, 0, 254});
  }
  expect_red(decode_raw(rgb, PixelFormat::rgb3, size, 0), "RGB3");
  expect_red(decode_raw(bgr, PixelFormat::bgr3, size, 0), "BGR3");
}

TEST(PictureBytes, RowsMayBePaddedAndTooFewBytesAreRefused) {
  Bytes grey{1, 2, 3, 99, 4, 5, 6};
  const cv::Mat image = decode_raw(grey, PixelFormat::grey, {3, 2}, 4);
  EXPECT_EQ(image.at<unsigned char>(1, 0), 4);
  grey[4] = 50;
  EXPECT_EQ(image.at<unsigned char>(1, 0), 4) << "its own memory";
  grey.pop_back();
  EXPECT_THROW(decode_raw(grey, PixelFormat::grey, {3, 2}, 4), SourceError);
  EXPECT_THROW(decode_raw({}, PixelFormat::yuyv, {4, 2}, 0), SourceError);
}

}  // namespace
}  // namespace skylight::service::test
