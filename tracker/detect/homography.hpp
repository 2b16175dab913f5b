// The baseline: the pipeline of find_object_2d as the paper used it (design section 6). Whole frame, ORB,
// ratio test, 8-parameter homography by RANSAC, depth at one pixel, no memory between frames.
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"
#include "tracker/depth/floor_depth.hpp"

namespace skylight {

/// How the detected point is carried to the floor.
enum class FloorDrop : std::uint8_t {
  vertical,  ///< straight down from the point that the depth gives (the paper: before)
  ray,       ///< the ray from the camera through the point goes on to z = 0 (the paper: first improvement)
};

struct HomographyConfig {
  int features = 500;      ///< of ORB, on the frame and on the picture, 10 to 20000
  double ratio = 0.8;      ///< nearest against second-nearest descriptor, 0 to 1
  double ransac_px = 3.0;  ///< reprojection threshold, > 0
  int min_inliers = 10;    ///< at least 4
  int picture_px = 100;  ///< longer side that the picture is brought to before features are taken, 16 to 2000
  int margin_px = 32;    ///< around it: ORB leaves 31 px at the edge without features, 0 to 200
  bool match_object_to_scene =
      true;  ///< false: each scene feature against the object, the package's own default
  FloorDrop drop = FloorDrop::vertical;
  /// What the detected point stands for, in base_link: (0, 0) is base_link itself (the paper: before),
  /// base_scan's place is the paper's second improvement. Metres.
  Eigen::Vector2d reference_m = Eigen::Vector2d::Zero();
  /// Standard deviation of a depth of z along the axis: floor + growth (z - 0.4 m)^2; the paper's camera is a
  /// Kinect: Nguyen, Izadi and Lovell, 3DIMPVT 2012, eq. 2. It goes into the covariance where the depth goes
  /// into the place (`vertical`). m, 0 to 1, and per m, 0 to 1.
  double depth_noise_floor_m = 0.0012;
  double depth_noise_growth = 0.0019;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const HomographyConfig& config);

/// ORB features as the baseline takes them.
struct HomographyFeatures {
  std::vector<cv::Point2f> places_px;
  cv::Mat descriptors;
};

/// Features of a whole frame: once per frame, for all robots with the same number of features.
HomographyFeatures extract_homography_features(const cv::Mat& image, int features);

/// Where a homography puts the picture in a frame.
struct HomographyMatch {
  Pixel centre;     ///< of the picture
  Pixel ahead;      ///< of a point a quarter of the picture ahead of it
  int inliers = 0;  ///< correspondences that agree with it ...
  int matches = 0;  ///< ... of so many
};

class HomographyDetector {
 public:
  /// Throws std::invalid_argument with check()'s message.
  HomographyDetector(std::shared_ptr<const Appearance> appearance, const HomographyConfig& config);

  const HomographyConfig& config() const { return config_; }

  /// None where fewer than min_inliers agree or the mapped centre cannot be carried to the floor. The
  /// score is inliers / matches. Where the frame has no depth (or none at that pixel) the ray is cut with
  /// the plane of the picture's height instead. `floor` corrects the depth; null: as the sensor reads it.
  std::optional<Observation> detect(const Frame& frame, const HomographyFeatures& scene,
                                    const CameraModel& camera, double surface_height_m,
                                    const FloorDepth* floor = nullptr) const;

  // The two halves of detect(), for whoever carries one match to the floor in several ways.
  std::optional<HomographyMatch> match(const HomographyFeatures& scene) const;
  std::optional<Observation> observe(const HomographyMatch& match, const Frame& frame,
                                     const CameraModel& camera, double surface_height_m,
                                     const FloorDepth* floor = nullptr) const;

 private:
  std::shared_ptr<const Appearance> appearance_;
  HomographyConfig config_;
  HomographyFeatures object_;
  cv::Size object_size_;
};

}  // namespace skylight
