#include "tracker/detect/homography.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "tracker/grey.hpp"

namespace skylight {
namespace {

struct Correspondences {
  std::vector<cv::Point2f> object;
  std::vector<cv::Point2f> scene;
};

Correspondences correspondences(const HomographyFeatures& object, const HomographyFeatures& scene,
                                const HomographyConfig& config) {
  const auto& query = config.match_object_to_scene ? object : scene;
  const auto& train = config.match_object_to_scene ? scene : object;
  Correspondences out;
  if (query.descriptors.empty() || train.descriptors.rows < 2) return out;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(query.descriptors, train.descriptors, nearest, 2);
  for (const auto& pair : nearest) {
    if (pair.size() < 2 || pair[0].distance > config.ratio * pair[1].distance) continue;
    const cv::Point2f at_query = query.places_px[static_cast<std::size_t>(pair[0].queryIdx)];
    const cv::Point2f at_train = train.places_px[static_cast<std::size_t>(pair[0].trainIdx)];
    out.object.push_back(config.match_object_to_scene ? at_query : at_train);
    out.scene.push_back(config.match_object_to_scene ? at_train : at_query);
  }
  return out;
}

// Metres along the optical axis at one pixel, as the baseline reads it: no neighbourhood, no median.
std::optional<double> depth_at(const cv::Mat& depth, const Pixel& pixel) {
  if (depth.empty()) return std::nullopt;
  const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
  if (!cv::Rect({}, depth.size()).contains(at)) return std::nullopt;
  const auto millimetres = depth.at<std::uint16_t>(at);
  if (millimetres == 0) return std::nullopt;
  return millimetres / 1000.0;
}

/// Where the detected point is carried to, and what the noise of the depth leaves unknown of it.
struct FloorPoint {
  Eigen::Vector2d at;
  Eigen::Matrix2d by_depth = Eigen::Matrix2d::Zero();  ///< covariance, m^2
};

/// Nguyen, Izadi and Lovell 2012, eq. 2.
double depth_sigma(double z, const HomographyConfig& config) {
  return config.depth_noise_floor_m + config.depth_noise_growth * (z - 0.4) * (z - 0.4);
}

std::optional<FloorPoint> on_plane(const CameraModel& camera, const Pixel& pixel, double height_m) {
  const auto at = camera.plane_from_pixel(pixel, height_m);
  return at ? std::optional(FloorPoint{*at}) : std::nullopt;
}

std::optional<FloorPoint> to_floor(const Pixel& pixel, const Frame& frame, const CameraModel& camera,
                                   double height_m, const HomographyConfig& config, const FloorDepth* floor) {
  if (config.drop == FloorDrop::ray) return on_plane(camera, pixel, 0.0);
  auto z = depth_at(frame.depth, pixel);
  if (z && floor != nullptr) z = floor->corrected(pixel, *z);
  const auto ray = camera.ray_from_pixel(pixel);
  if (!z || !ray || ray->z() <= 0.0) return on_plane(camera, pixel, height_m);
  const Eigen::Vector3d per_metre = camera.map_from_camera().linear() * (*ray / ray->z());
  const Eigen::Vector3d point = camera.map_from_camera().translation() + *z * per_metre;
  const Eigen::Vector2d by_depth = depth_sigma(*z, config) * per_metre.head<2>();
  return FloorPoint{.at = point.head<2>(), .by_depth = by_depth * by_depth.transpose()};
}

Pixel mapped(const cv::Mat& homography, const cv::Point2d& point) {
  const cv::Matx33d h = homography;
  const cv::Vec3d p = h * cv::Vec3d(point.x, point.y, 1.0);
  return {p[0] / p[2], p[1] / p[2]};
}

}  // namespace

std::string check(const HomographyConfig& config) {
  std::ostringstream text;
  const auto range = [&text](const char* field, double value, double min, double max) {
    if (text.tellp() == 0 && !(value >= min && value <= max)) {
      text << "homography." << field << " is " << value << ", allowed " << min << " to " << max;
    }
  };
  range("features", config.features, 10, 20000);
  range("ratio", config.ratio, 0.0, 1.0);
  range("ransac_px", config.ransac_px, 0.01, 100.0);
  range("min_inliers", config.min_inliers, 4, 1000);
  range("picture_px", config.picture_px, 16, 2000);
  range("margin_px", config.margin_px, 0, 200);
  range("reference_m.x", config.reference_m.x(), -10.0, 10.0);
  range("reference_m.y", config.reference_m.y(), -10.0, 10.0);
  range("depth_noise_floor_m", config.depth_noise_floor_m, 0.0, 1.0);
  range("depth_noise_growth", config.depth_noise_growth, 0.0, 1.0);
  return text.str();
}

HomographyFeatures extract_homography_features(const cv::Mat& image, int features) {
  HomographyFeatures out;
  std::vector<cv::KeyPoint> points;
  cv::ORB::create(features)->detectAndCompute(grey_of(image), cv::noArray(), points, out.descriptors);
  cv::KeyPoint::convert(points, out.places_px);
  return out;
}

HomographyDetector::HomographyDetector(std::shared_ptr<const Appearance> appearance,
                                       const HomographyConfig& config)
    : appearance_(std::move(appearance)), config_(config) {
  if (const std::string wrong = check(config); !wrong.empty()) throw std::invalid_argument(wrong);
  const cv::Mat& picture = appearance_->picture().image;
  const double scale = static_cast<double>(config.picture_px) / std::max(picture.cols, picture.rows);
  cv::Mat image;
  cv::resize(grey_of(picture), image, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  const int m = config.margin_px;
  cv::copyMakeBorder(image, image, m, m, m, m, cv::BORDER_CONSTANT, cv::mean(image));
  object_size_ = image.size();
  object_ = extract_homography_features(image, config.features);
}

std::optional<HomographyMatch> HomographyDetector::match(const HomographyFeatures& scene) const {
  const Correspondences pairs = correspondences(object_, scene, config_);
  if (pairs.object.size() < static_cast<std::size_t>(config_.min_inliers)) return std::nullopt;
  cv::Mat inlier;
  const cv::Mat homography =
      cv::findHomography(pairs.object, pairs.scene, cv::RANSAC, config_.ransac_px, inlier);
  const int inliers = homography.empty() ? 0 : cv::countNonZero(inlier);
  if (inliers < config_.min_inliers) return std::nullopt;
  const cv::Point2d centre((object_size_.width - 1) / 2.0, (object_size_.height - 1) / 2.0);
  return HomographyMatch{.centre = mapped(homography, centre),
                         .ahead = mapped(homography, {centre.x, centre.y - config_.picture_px / 4.0}),
                         .inliers = inliers,
                         .matches = static_cast<int>(pairs.object.size())};
}

std::optional<Observation> HomographyDetector::observe(const HomographyMatch& match, const Frame& frame,
                                                       const CameraModel& camera, double surface_height_m,
                                                       const FloorDepth* floor) const {
  const Pixel& at = match.centre;
  if (!at.allFinite() || !match.ahead.allFinite() || !camera.sees(at)) return std::nullopt;
  const auto place = to_floor(at, frame, camera, surface_height_m, config_, floor);
  Eigen::Matrix2d metres_by_px;
  const auto from = camera.plane_from_pixel(at, surface_height_m, &metres_by_px);
  const auto to = camera.plane_from_pixel(match.ahead, surface_height_m);
  if (!place || !from || !to || (*to - *from).norm() < 1e-9) return std::nullopt;

  Observation observation{
      .captured = frame.captured, .source = PoseSource::homography, .camera = frame.camera};
  const double yaw = std::atan2(to->y() - from->y(), to->x() - from->x());
  const Eigen::Vector2d base = place->at - Eigen::Rotation2Dd(yaw) * config_.reference_m;
  observation.pose = {base.x(), base.y(), wrap_angle(yaw)};
  observation.score = static_cast<double>(match.inliers) / match.matches;
  // Eight parameters from 2 n coordinates, each within the RANSAC threshold: sigma^2 * 8 / (2 n) at the
  // centre.
  const double sigma_px = config_.ransac_px / 2.0;
  const double position_px = sigma_px * std::sqrt(4.0 / match.inliers);
  observation.covariance.setZero();
  observation.covariance.topLeftCorner<2, 2>() =
      position_px * position_px * metres_by_px * metres_by_px.transpose() + place->by_depth;
  observation.covariance(2, 2) = std::pow(position_px / (config_.picture_px / 4.0), 2);
  return observation;
}

std::optional<Observation> HomographyDetector::detect(const Frame& frame, const HomographyFeatures& scene,
                                                      const CameraModel& camera, double surface_height_m,
                                                      const FloorDepth* floor) const {
  const auto found = match(scene);
  return found ? observe(*found, frame, camera, surface_height_m, floor) : std::nullopt;
}

}  // namespace skylight
