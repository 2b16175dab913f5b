#include "service/sources/live/picture_bytes.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "service/sources/source.hpp"

namespace skylight::service {
namespace {

using Bytes = std::span<const unsigned char>;

int big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  unsigned value = 0;
  for (std::size_t i = 0; i < count; ++i) value = (value << 8) | bytes[at + i];
  return static_cast<int>(value & 0x7fffffffU);
}

// The IHDR chunk comes first (PNG specification, 11.2.2).
std::optional<cv::Size> png_size(Bytes bytes) {
  constexpr std::array<unsigned char, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  if (bytes.size() < 24 || !std::equal(kSignature.begin(), kSignature.end(), bytes.begin()))
    return std::nullopt;
  return cv::Size(big_endian(bytes, 16, 4), big_endian(bytes, 20, 4));
}

// The frame header, a marker SOF0 to SOF15 without DHT, JPG and DAC (ITU T.81, tables B.1 and B.2).
std::optional<cv::Size> jpeg_size(Bytes bytes) {
  if (bytes.size() < 4 || bytes[0] != 0xff || bytes[1] != 0xd8) return std::nullopt;
  std::size_t at = 2;
  while (at + 9 < bytes.size()) {
    if (bytes[at] != 0xff) return std::nullopt;
    const unsigned marker = bytes[at + 1];
    if (marker == 0xff) {  // fill bytes
      ++at;
      continue;
    }
    const bool frame_header =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame_header) return cv::Size(big_endian(bytes, at + 7, 2), big_endian(bytes, at + 5, 2));
    const int length = big_endian(bytes, at + 2, 2);
    if (length < 2) return std::nullopt;
    at += 2 + static_cast<std::size_t>(length);
  }
  return std::nullopt;
}

std::string size_text(cv::Size size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height) + " px";
}

struct Layout {
  int type;      ///< of a row of the first plane
  int rows_num;  ///< rows of all planes: height * rows_num / rows_den
  int rows_den;
  int conversion;  ///< to BGR; -1: none
};

Layout layout_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::yuyv:
      return {CV_8UC2, 1, 1, cv::COLOR_YUV2BGR_YUYV};
    case PixelFormat::uyvy:
      return {CV_8UC2, 1, 1, cv::COLOR_YUV2BGR_UYVY};
    case PixelFormat::nv12:
      return {CV_8UC1, 3, 2, cv::COLOR_YUV2BGR_NV12};
    case PixelFormat::rgb3:
      return {CV_8UC3, 1, 1, cv::COLOR_RGB2BGR};
    case PixelFormat::bgr3:
      return {CV_8UC3, 1, 1, -1};
    case PixelFormat::mjpg:
    case PixelFormat::grey:
      break;
  }
  return {CV_8UC1, 1, 1, -1};
}

}  // namespace

std::optional<cv::Size> stated_size(Bytes bytes) {
  const auto png = png_size(bytes);
  return png ? png : jpeg_size(bytes);
}

cv::Mat decode_picture(Bytes bytes, cv::Size size) {
  const auto stated = stated_size(bytes);
  if (!stated) throw SourceError("no JPEG or PNG picture");
  if (*stated != size) {
    throw SourceError("the picture has " + size_text(*stated) + ", the camera is calibrated for " +
                      size_text(size));
  }
  cv::Mat image;
  try {
    const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<unsigned char*>(bytes.data()));
    image = cv::imdecode(raw, cv::IMREAD_ANYCOLOR);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty() || image.size() != size) throw SourceError("the picture is damaged");
  return image;
}

cv::Mat decode_raw(Bytes bytes, PixelFormat format, cv::Size size, std::size_t stride) {
  if (format == PixelFormat::mjpg) return decode_picture(bytes, size);
  const Layout layout = layout_of(format);
  const int rows = size.height * layout.rows_num / layout.rows_den;
  const std::size_t row = static_cast<std::size_t>(size.width) * CV_ELEM_SIZE(layout.type);
  const std::size_t step = stride == 0 ? row : stride;
  const std::size_t needed = step * static_cast<std::size_t>(rows - 1) + row;
  if (rows <= 0 || step < row || bytes.size() < needed) {
    throw SourceError("a picture of " + std::to_string(bytes.size()) + " bytes, " + size_text(size) + " of " +
                      std::string(to_string(format)) + " need " + std::to_string(needed));
  }
  const cv::Mat raw(rows, size.width, layout.type, const_cast<unsigned char*>(bytes.data()), step);
  if (layout.conversion < 0) return raw.clone();
  cv::Mat image;
  cv::cvtColor(raw, image, layout.conversion);
  return image;
}

std::string_view to_string(PixelFormat format) {
  constexpr std::array<std::string_view, 7> kNames{"MJPG", "YUYV", "UYVY", "NV12", "GREY", "BGR3", "RGB3"};
  return kNames[static_cast<std::size_t>(format)];
}

}  // namespace skylight::service
