#include "tracker/appearance.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace skylight {
namespace {

constexpr int kMinSidePx = 8;
constexpr int kMaxSidePx = 8192;
constexpr double kMinContrast = 6.0;  // grey levels, standard deviation within the mask
constexpr double kColourShare =
    0.15;  // chroma contrast over grey contrast above which colour is worth its cost
constexpr double kLooksTheSame = 0.90;  // correlation of the picture with itself turned

[[noreturn]] void refuse(const std::string& id, const std::string& what) {
  throw std::invalid_argument("appearance '" + id + "': " + what);
}

void check_range(const std::string& id, const char* field, double value, double min, double max) {
  if (value >= min && value <= max) return;
  std::ostringstream text;
  text << field << " is " << value << ", allowed " << min << " to " << max;
  refuse(id, text.str());
}

void check_picture(const std::string& id, const Picture& picture) {
  const cv::Mat& image = picture.image;
  if (image.empty()) refuse(id, "the picture is empty");
  if (image.depth() != CV_8U || (image.channels() != 1 && image.channels() != 3 && image.channels() != 4)) {
    refuse(id, "the picture must have 8 bits and 1, 3 or 4 channels");
  }
  if (std::min(image.cols, image.rows) < kMinSidePx || std::max(image.cols, image.rows) > kMaxSidePx) {
    refuse(id, "the picture is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) +
                   " px, allowed " + std::to_string(kMinSidePx) + " to " + std::to_string(kMaxSidePx) +
                   " a side");
  }
  check_range(id, "metres_per_pixel", picture.metres_per_pixel, 1e-5, 0.1);
  check_range(id, "surface_height_m", picture.surface_height_m, -1.0, 5.0);
  check_range(id, "reference_point_m.x", picture.reference_point_m.x(), -10.0, 10.0);
  check_range(id, "reference_point_m.y", picture.reference_point_m.y(), -10.0, 10.0);
  check_range(id, "footprint_m", picture.footprint_m, 0.0, 0.2);
}

cv::Mat mask_of(const cv::Mat& image) {
  if (image.channels() != 4) return {image.size(), CV_32FC1, cv::Scalar(1.0)};
  cv::Mat alpha;
  cv::extractChannel(image, alpha, 3);
  cv::Mat mask;
  cv::Mat(alpha >= 128).convertTo(mask, CV_32FC1, 1.0 / 255.0);
  return mask;
}

double contrast(const cv::Mat& grey, const cv::Mat& mask) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(grey, mean, deviation, cv::Mat(mask > 0.5F));
  return deviation[0];
}

// Standard deviation of the colour differences, which grey does not see.
double chroma_contrast(const cv::Mat& bgr, const cv::Mat& mask) {
  std::vector<cv::Mat> planes;
  cv::split(bgr, planes);
  return std::max(contrast(planes[0] - planes[1], mask), contrast(planes[2] - planes[1], mask));
}

// Correlation over the pixels that both masks keep, all channels together, means removed per channel.
double masked_correlation(const cv::Mat& a, const cv::Mat& b, const cv::Mat& both) {
  const cv::Mat keep = both > 0.5F;
  if (cv::countNonZero(keep) < 16) return 0.0;
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (int c = 0; c < a.channels(); ++c) {
    cv::Mat pa;
    cv::Mat pb;
    cv::extractChannel(a, pa, c);
    cv::extractChannel(b, pb, c);
    const cv::Mat da = (pa - cv::mean(pa, keep)[0]).mul(both);
    const cv::Mat db = (pb - cv::mean(pb, keep)[0]).mul(both);
    ab += da.dot(db);
    aa += da.dot(da);
    bb += db.dot(db);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

// The best correlation of the picture with itself turned by `degrees` about its centre, at a size where
// robots are seen (a turned copy of fine print is no help to a camera that cannot resolve it). A shift of
// a pixel either way is allowed: people cut boxes by hand.
double correlation_turned(const cv::Mat& values, const cv::Mat& mask, double degrees) {
  const cv::Point2f centre((static_cast<float>(values.cols) - 1) / 2,
                           (static_cast<float>(values.rows) - 1) / 2);
  double best = -1.0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      cv::Mat turn = cv::getRotationMatrix2D(centre, degrees, 1.0);
      turn.at<double>(0, 2) += dx;
      turn.at<double>(1, 2) += dy;
      cv::Mat turned;
      cv::Mat turned_mask;
      cv::warpAffine(values, turned, turn, values.size());
      cv::warpAffine(mask, turned_mask, turn, mask.size());
      cv::Mat both;
      cv::threshold(mask.mul(turned_mask), both, 0.9, 1.0, cv::THRESH_BINARY);
      best = std::max(best, masked_correlation(values, turned, both));
    }
  }
  return best;
}

int count_heading_turns(const cv::Mat& values, const cv::Mat& mask) {
  constexpr double kSidePx = 32.0;
  const double scale = std::min(1.0, kSidePx / std::max(values.cols, values.rows));
  cv::Mat small;
  cv::Mat small_mask;
  cv::resize(values, small, {}, scale, scale, cv::INTER_AREA);
  cv::resize(mask, small_mask, {}, scale, scale, cv::INTER_AREA);
  if (correlation_turned(small, small_mask, 180.0) < kLooksTheSame) return 1;
  return correlation_turned(small, small_mask, 90.0) < kLooksTheSame ? 2 : 4;
}

}  // namespace

Appearance::Appearance(std::string id, Picture picture) : id_(std::move(id)), picture_(std::move(picture)) {
  check_picture(id_, picture_);
  picture_.image = picture_.image.clone();  // the caller's buffer may change
  if (picture_.footprint_m == 0.0) picture_.footprint_m = picture_.metres_per_pixel;
  mask_ = mask_of(picture_.image);

  cv::Mat bgr;
  if (picture_.image.channels() == 1) {
    picture_.image.convertTo(values_, CV_32F);
  } else {
    cv::Mat colour = picture_.image;
    if (colour.channels() == 4) cv::cvtColor(colour, colour, cv::COLOR_BGRA2BGR);
    colour.convertTo(bgr, CV_32F);
    cv::cvtColor(bgr, values_, cv::COLOR_BGR2GRAY);
  }
  const double grey_contrast = contrast(values_, mask_);
  const double colour_contrast = bgr.empty() ? 0.0 : chroma_contrast(bgr, mask_);
  if (std::max(grey_contrast, colour_contrast) < kMinContrast) {
    std::ostringstream text;
    text << "the picture has one colour only (contrast " << std::max(grey_contrast, colour_contrast)
         << " grey levels, at least " << kMinContrast << " needed): there is nothing to align";
    refuse(id_, text.str());
  }
  if (colour_contrast > kColourShare * grey_contrast) values_ = bgr;
  heading_turns_ = count_heading_turns(values_, mask_);
}

Eigen::Vector2d Appearance::size_m() const {
  return Eigen::Vector2d(picture_.image.rows, picture_.image.cols) * picture_.metres_per_pixel;
}

Picture cut_from_frame(const Frame& frame, const CameraModel& camera, const FrameCut& cut, Pose2* pose) {
  const cv::Rect2d& box = cut.box_px;
  const bool inside = box.x >= -0.5 && box.y >= -0.5 && box.x + box.width <= frame.image.cols - 0.5 &&
                      box.y + box.height <= frame.image.rows - 0.5;
  if (!inside || !(box.width >= kMinSidePx) || !(box.height >= kMinSidePx)) {
    throw std::invalid_argument("the box must lie in the picture of " + std::to_string(frame.image.cols) +
                                " x " + std::to_string(frame.image.rows) +
                                " px and have at least 8 px a side");
  }
  const Pixel centre_px(box.x + box.width / 2, box.y + box.height / 2);
  Eigen::Matrix2d metres_by_px;
  const auto centre = camera.plane_from_pixel(centre_px, cut.surface_height_m, &metres_by_px);
  if (!centre)
    throw std::invalid_argument("the camera does not see the plane at that height through the box");
  const double metres_per_px = std::sqrt(std::abs(metres_by_px.determinant()));

  // The box's corners in the robot's axes bound the rectified picture.
  const Eigen::Rotation2Dd robot_from_map(-cut.yaw);
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  for (const double u : {box.x, box.x + box.width}) {
    for (const double v : {box.y, box.y + box.height}) {
      const auto corner = camera.plane_from_pixel({u, v}, cut.surface_height_m);
      if (!corner)
        throw std::invalid_argument("the camera does not see the plane at that height through the box");
      half = half.cwiseMax((robot_from_map * (*corner - *centre)).cwiseAbs());
    }
  }
  const int rows = static_cast<int>(std::ceil(2 * half.x() / metres_per_px - 1e-6));
  const int cols = static_cast<int>(std::ceil(2 * half.y() / metres_per_px - 1e-6));
  if (std::max(rows, cols) > kMaxSidePx) {
    throw std::invalid_argument("the box spans too much of the floor: " + std::to_string(cols) + " x " +
                                std::to_string(rows) + " px once rectified, at most " +
                                std::to_string(kMaxSidePx));
  }
  cv::Mat map_x(rows, cols, CV_32FC1);
  cv::Mat map_y(rows, cols, CV_32FC1);
  cv::Mat alpha(rows, cols, CV_8UC1, cv::Scalar(0));
  const Eigen::Rotation2Dd map_from_robot(cut.yaw);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      const Eigen::Vector2d in_robot =
          Eigen::Vector2d((rows - 1) / 2.0 - r, (cols - 1) / 2.0 - c) * metres_per_px;
      const Eigen::Vector2d at = *centre + map_from_robot * in_robot;
      const auto pixel = camera.pixel_from_map({at.x(), at.y(), cut.surface_height_m});
      const bool in_box = pixel && pixel->x() >= box.x && pixel->x() <= box.x + box.width &&
                          pixel->y() >= box.y && pixel->y() <= box.y + box.height;
      map_x.at<float>(r, c) = in_box ? static_cast<float>(pixel->x()) : -1.0F;
      map_y.at<float>(r, c) = in_box ? static_cast<float>(pixel->y()) : -1.0F;
      alpha.at<uchar>(r, c) = in_box ? 255 : 0;
    }
  }
  cv::Mat colour;
  cv::remap(frame.image, colour, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  if (colour.channels() == 1) cv::cvtColor(colour, colour, cv::COLOR_GRAY2BGR);
  std::vector<cv::Mat> planes;
  cv::split(colour, planes);
  planes.push_back(alpha);
  Picture picture{.metres_per_pixel = metres_per_px,
                  .surface_height_m = cut.surface_height_m,
                  .footprint_m = metres_per_px};
  cv::merge(planes, picture.image);
  if (pose != nullptr) *pose = {centre->x(), centre->y(), wrap_angle(cut.yaw)};
  return picture;
}

}  // namespace skylight
