// Pictures as they come over a wire: compressed ones, and a sensor's raw layouts.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include <opencv2/core/mat.hpp>

#include "service/sources/live/kinds.hpp"

namespace skylight::service {

/// Width and height as a JPEG or PNG states them in its head, without decoding; none for anything else.
std::optional<cv::Size> stated_size(std::span<const unsigned char> bytes);

/// A JPEG or PNG of this size as BGR or grey, 8 bits. Throws SourceError: no such picture, of another size
/// (then before memory is taken for it), damaged.
cv::Mat decode_picture(std::span<const unsigned char> bytes, cv::Size size);

/// `stride`: bytes from one row to the next (of the first plane); 0: as many as a row has, or compressed. The
/// result is its own memory, CV_8UC1 for grey, CV_8UC3 (BGR) else. Throws SourceError where there are too few
/// bytes, or they are no picture.
cv::Mat decode_raw(std::span<const unsigned char> bytes, PixelFormat format, cv::Size size,
                   std::size_t stride);

std::string_view to_string(PixelFormat format);

}  // namespace skylight::service
