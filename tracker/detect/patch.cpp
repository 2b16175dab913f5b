#include "tracker/detect/patch.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace skylight {
namespace {

struct BlurredPicture {
  cv::Mat values;  // CV_32FCn
  cv::Mat mask;    // CV_32FC1, 1 where only the picture contributed
  int margin_px = 0;
};

BlurredPicture blur_picture(const Appearance& appearance, const PatchScale& scale) {
  const double pixel = scale.metres_per_px;
  const double wanted = pixel * pixel * (1.0 / 12.0 + 1.0 / 6.0 + scale.blur_px * scale.blur_px);
  const double footprint = appearance.picture().footprint_m;
  const double missing = std::max(0.0, wanted - footprint * footprint / 12.0);
  const double sigma_px = std::sqrt(missing) / appearance.picture().metres_per_pixel;

  cv::Mat values = appearance.values();
  if (scale.channels == 1 && values.channels() == 3) cv::cvtColor(values, values, cv::COLOR_BGR2GRAY);
  BlurredPicture out;
  out.margin_px = static_cast<int>(std::ceil(3.0 * sigma_px)) + 1;
  const int m = out.margin_px;
  cv::copyMakeBorder(appearance.mask(), out.mask, m, m, m, m, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::copyMakeBorder(values, out.values, m, m, m, m, cv::BORDER_REPLICATE);

  std::vector<cv::Mat> planes;
  cv::split(out.values, planes);
  cv::Mat weight;
  const auto smooth = [&](const cv::Mat& from, cv::Mat& to) {
    if (sigma_px < 0.2) {
      from.copyTo(to);
    } else {
      cv::GaussianBlur(from, to, {}, sigma_px, sigma_px, cv::BORDER_CONSTANT);
    }
  };
  smooth(out.mask, weight);
  for (cv::Mat& plane : planes) {
    cv::Mat weighted;
    smooth(plane.mul(out.mask), weighted);
    plane = weighted / cv::max(weight, 1e-3F);
  }
  cv::merge(planes, out.values);
  out.mask = weight;
  return out;
}

Eigen::ArrayXf read_at(const cv::Mat& plane, const std::vector<cv::Point2f>& places) {
  cv::Mat at;
  cv::remap(plane, at, cv::Mat(places), cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return Eigen::Map<const Eigen::ArrayXf>(at.ptr<float>(), static_cast<Eigen::Index>(places.size()));
}

Patch::Channel make_channel(const Patch& patch, const cv::Mat& plane, const std::vector<cv::Point2f>& places,
                            double metres_per_pixel) {
  cv::Mat by_column;
  cv::Mat by_row;
  const cv::Mat difference = (cv::Mat_<float>(1, 3) << -0.5F, 0.0F, 0.5F);
  cv::filter2D(plane, by_column, CV_32F, difference, {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::filter2D(plane, by_row, CV_32F, difference.t(), {-1, -1}, 0, cv::BORDER_REPLICATE);
  // Forward is up the picture and left is to its left: both against the direction of the indices.
  const auto per_px = static_cast<float>(-patch.scale.metres_per_px / metres_per_pixel);
  const Eigen::ArrayXf slope_x = read_at(by_row, places) * per_px;
  const Eigen::ArrayXf slope_y = read_at(by_column, places) * per_px;
  const Eigen::ArrayXf value = read_at(plane, places);

  Patch::Channel channel;
  channel.terms.resize(patch.size(), 5);
  channel.terms.col(0) = slope_x;
  channel.terms.col(1) = slope_y;
  channel.terms.col(2) = (patch.x * slope_y - patch.y * slope_x) / static_cast<float>(patch.radius_m);
  channel.terms.col(3) = value - value.mean();
  channel.terms.col(4).setOnes();
  channel.contrast = std::sqrt(channel.terms.col(3).squaredNorm() / static_cast<float>(patch.size()));
  return channel;
}

}  // namespace

Patch make_patch(const Appearance& appearance, const PatchScale& scale) {
  constexpr float kOnlyThePicture = 0.97F;
  const BlurredPicture blurred = blur_picture(appearance, scale);
  const Eigen::Vector2d size = appearance.size_m();
  const double metres_per_pixel = appearance.picture().metres_per_pixel;

  Patch patch;
  patch.scale = scale;
  patch.spacing_m = std::max(scale.metres_per_px, std::sqrt(size.x() * size.y() / scale.max_samples));
  const int half_x = static_cast<int>(size.x() / 2 / patch.spacing_m);
  const int half_y = static_cast<int>(size.y() / 2 / patch.spacing_m);
  const double middle_row = (blurred.mask.rows - 1) / 2.0;
  const double middle_column = (blurred.mask.cols - 1) / 2.0;
  // Where the blur reaches across most of a small picture, the border is better than nothing.
  double largest = 0.0;
  cv::minMaxLoc(blurred.mask, nullptr, &largest);
  const float keep = kOnlyThePicture * static_cast<float>(std::min(1.0, largest));

  std::vector<cv::Point2f> places;
  std::vector<float> forward;
  std::vector<float> left;
  for (int i = -half_x; i <= half_x; ++i) {
    for (int j = -half_y; j <= half_y; ++j) {
      const double x = i * patch.spacing_m;
      const double y = j * patch.spacing_m;
      const double row = middle_row - x / metres_per_pixel;
      const double column = middle_column - y / metres_per_pixel;
      if (blurred.mask.at<float>(static_cast<int>(std::lround(row)), static_cast<int>(std::lround(column))) <
          keep)
        continue;
      places.emplace_back(static_cast<float>(column), static_cast<float>(row));
      forward.push_back(static_cast<float>(x));
      left.push_back(static_cast<float>(y));
      patch.radius_m = std::max(patch.radius_m, std::hypot(x, y));
    }
  }
  if (patch.radius_m == 0.0) return patch;  // too far away to have more than one sample
  patch.x = Eigen::Map<const Eigen::ArrayXf>(forward.data(), static_cast<Eigen::Index>(forward.size()));
  patch.y = Eigen::Map<const Eigen::ArrayXf>(left.data(), static_cast<Eigen::Index>(left.size()));
  std::vector<cv::Mat> planes;
  cv::split(blurred.values, planes);
  for (const cv::Mat& plane : planes)
    patch.channels.push_back(make_channel(patch, plane, places, metres_per_pixel));
  return patch;
}

}  // namespace skylight
