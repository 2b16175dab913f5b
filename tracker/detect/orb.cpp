#include "tracker/detect/orb.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "tracker/grey.hpp"

namespace skylight {
namespace {

using Eigen::Vector2d;

constexpr int kPyramidLevels = 4;  // factor 1.2: the scale is known, the pyramid covers what rounding leaves
constexpr int kFastThreshold = 10;
constexpr int kEdge = 31;

cv::Ptr<cv::ORB> make_orb(int features) {
  return cv::ORB::create(features, 1.2F, kPyramidLevels, kEdge, 0, 2, cv::ORB::HARRIS_SCORE, 31,
                         kFastThreshold);
}

struct Match {
  Vector2d picture_m;  // in base_link
  Vector2d scene_m;    // in map
};

std::vector<Match> match(const OrbModel& model, const OrbScene& scene, const CameraModel& camera,
                         double height_m, const OrbConfig& config) {
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(model.descriptors, scene.descriptors, nearest, 2);
  std::vector<std::pair<double, cv::DMatch>> good;
  for (const auto& pair : nearest) {
    if (pair.size() < 2) continue;
    const double ratio = pair[0].distance / std::max(1.0F, pair[1].distance);
    if (ratio < config.ratio) good.emplace_back(ratio, pair[0]);
  }
  std::sort(good.begin(), good.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first, a.second.queryIdx) < std::tie(b.first, b.second.queryIdx);
  });
  if (good.size() > static_cast<std::size_t>(config.max_matches))
    good.resize(static_cast<std::size_t>(config.max_matches));
  std::vector<Match> matches;
  for (const auto& [ratio, m] : good) {
    const auto place =
        camera.plane_from_pixel(scene.places_px[static_cast<std::size_t>(m.trainIdx)], height_m);
    if (place) matches.push_back({model.places_m[static_cast<std::size_t>(m.queryIdx)], *place});
  }
  return matches;
}

Pose2 pose_of_pair(const Match& a, const Match& b) {
  const Vector2d in_picture = b.picture_m - a.picture_m;
  const Vector2d in_scene = b.scene_m - a.scene_m;
  const double yaw =
      wrap_angle(std::atan2(in_scene.y(), in_scene.x()) - std::atan2(in_picture.y(), in_picture.x()));
  const Vector2d base =
      0.5 * (a.scene_m + b.scene_m) - Eigen::Rotation2Dd(yaw) * (0.5 * (a.picture_m + b.picture_m));
  return {base.x(), base.y(), yaw};
}

std::vector<std::size_t> inliers_of(const std::vector<Match>& matches, const Pose2& pose,
                                    double tolerance_m) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(pose.yaw).toRotationMatrix();
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Vector2d miss = pose.position() + turn * matches[i].picture_m - matches[i].scene_m;
    if (miss.squaredNorm() < tolerance_m * tolerance_m) inliers.push_back(i);
  }
  return inliers;
}

// Rigid motion in the plane by least squares (Horn 1987 in two dimensions, closed form).
OrbPose fit(const std::vector<Match>& matches, const std::vector<std::size_t>& inliers) {
  Vector2d picture = Vector2d::Zero();
  Vector2d scene = Vector2d::Zero();
  for (const std::size_t i : inliers) {
    picture += matches[i].picture_m;
    scene += matches[i].scene_m;
  }
  const auto n = static_cast<double>(inliers.size());
  picture /= n;
  scene /= n;
  double along = 0.0;
  double across = 0.0;
  for (const std::size_t i : inliers) {
    const Vector2d p = matches[i].picture_m - picture;
    const Vector2d s = matches[i].scene_m - scene;
    along += p.dot(s);
    across += p.x() * s.y() - p.y() * s.x();
  }
  OrbPose out{.inliers = static_cast<int>(inliers.size())};
  out.pose.yaw = wrap_angle(std::atan2(across, along));
  const Eigen::Rotation2Dd turn(out.pose.yaw);
  const Vector2d base = scene - turn * picture;
  out.pose.x = base.x();
  out.pose.y = base.y();
  double squares = 0.0;
  for (const std::size_t i : inliers)
    squares += (base + turn * matches[i].picture_m - matches[i].scene_m).squaredNorm();
  out.residual_m = std::sqrt(squares / n);
  return out;
}

// The pair of matches whose pose most others agree with.
std::vector<std::size_t> largest_consensus(const std::vector<Match>& matches, double tolerance_m) {
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    for (std::size_t j = i + 1; j < matches.size(); ++j) {
      const double in_picture = (matches[i].picture_m - matches[j].picture_m).norm();
      const double in_scene = (matches[i].scene_m - matches[j].scene_m).norm();
      if (in_picture < 4 * tolerance_m || std::abs(in_picture - in_scene) > 2 * tolerance_m) continue;
      auto inliers = inliers_of(matches, pose_of_pair(matches[i], matches[j]), tolerance_m);
      if (inliers.size() > best.size()) best = std::move(inliers);
    }
  }
  return best;
}

}  // namespace

OrbModel make_orb_model(const Appearance& appearance, const OrbConfig& config) {
  const Picture& picture = appearance.picture();
  const Eigen::Vector2d size = appearance.size_m();
  OrbModel model;
  model.px_per_metre = config.picture_px / size.maxCoeff();
  const double scale = model.px_per_metre * picture.metres_per_pixel;
  cv::Mat image;
  cv::resize(grey_of(picture.image), image, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  cv::Mat mask;
  appearance.mask().convertTo(mask, CV_8U, 255.0);
  cv::resize(mask, mask, image.size(), 0, 0, cv::INTER_NEAREST);
  const int m = config.margin_px;
  const cv::Scalar around = cv::mean(image, mask);
  image.setTo(around, mask == 0);
  cv::copyMakeBorder(image, image, m, m, m, m, cv::BORDER_CONSTANT, around);
  cv::copyMakeBorder(mask, mask, m, m, m, m, cv::BORDER_CONSTANT, cv::Scalar(0));
  std::vector<cv::KeyPoint> points;
  make_orb(config.picture_features)->detectAndCompute(image, mask, points, model.descriptors);
  const double middle_x = (image.cols - 1) / 2.0;
  const double middle_y = (image.rows - 1) / 2.0;
  for (const cv::KeyPoint& point : points) {
    const Vector2d from_centre((middle_y - point.pt.y) / model.px_per_metre,
                               (middle_x - point.pt.x) / model.px_per_metre);
    model.places_m.push_back(from_centre + appearance.centre_m());
  }
  return model;
}

OrbScene extract_orb(const Frame& frame, const cv::Rect& roi, double upsample) {
  OrbScene scene;
  const cv::Rect part = roi & cv::Rect({}, frame.image.size());
  if (part.width < 8 || part.height < 8) return scene;
  cv::Mat image;
  cv::resize(grey_of(frame.image(part)), image, {}, upsample, upsample,
             upsample < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::copyMakeBorder(image, image, kEdge, kEdge, kEdge, kEdge, cv::BORDER_REPLICATE);
  std::vector<cv::KeyPoint> points;
  const int features = std::clamp(static_cast<int>(image.total() / 200), 300, 4000);
  make_orb(features)->detectAndCompute(image, cv::noArray(), points, scene.descriptors);
  scene.places_px.reserve(points.size());
  for (const cv::KeyPoint& point : points) {
    // Pixel centres: resize maps x to (x + 0.5) * upsample - 0.5.
    scene.places_px.emplace_back((point.pt.x - kEdge + 0.5) / upsample - 0.5 + part.x,
                                 (point.pt.y - kEdge + 0.5) / upsample - 0.5 + part.y);
  }
  return scene;
}

std::vector<OrbPose> find_orb(const OrbModel& model, const OrbScene& scene, const CameraModel& camera,
                              double surface_height_m, const OrbConfig& config, int max_poses) {
  std::vector<OrbPose> poses;
  if (model.places_m.empty() || scene.places_px.size() < 2) return poses;
  std::vector<Match> matches = match(model, scene, camera, surface_height_m, config);
  Eigen::Matrix2d metres_by_px;
  if (matches.size() < static_cast<std::size_t>(config.min_inliers) ||
      !camera.plane_from_pixel(scene.places_px.front(), surface_height_m, &metres_by_px)) {
    return poses;
  }
  const double tolerance_m = config.tolerance_px * std::sqrt(std::abs(metres_by_px.determinant()));
  while (static_cast<int>(poses.size()) < max_poses) {
    auto inliers = largest_consensus(matches, tolerance_m);
    if (inliers.size() < static_cast<std::size_t>(config.min_inliers)) break;
    const OrbPose rough = fit(matches, inliers);
    if (auto again = inliers_of(matches, rough.pose, tolerance_m); again.size() >= inliers.size())
      inliers = std::move(again);
    poses.push_back(fit(matches, inliers));
    for (auto i = inliers.rbegin(); i != inliers.rend(); ++i)
      matches.erase(matches.begin() + static_cast<std::ptrdiff_t>(*i));
  }
  return poses;
}

}  // namespace skylight
