// AprilTags: which of them a picture shows, and where their corners are. libapriltag (Olson 2011; Wang and
// Olson 2016) finds and reads the squares; the corners come from the whole pattern (apriltag_fit).
//
// Its .cpp is the one file of the tracker that knows libapriltag.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>

#include "tracker/types.hpp"

namespace skylight {

/// A tag on a robot.
struct TagSpec {
  std::string family = "36h11";  ///< one of tag_families()
  int id = 0;                    ///< 0 to tag_count(family) - 1
  /// Edge of the square between the corners that are found, 0.005 to 5 m: the outer edge of the black border
  /// (Standard41h12: of the white ring inside the black one). The white rim around it does not count.
  double size_m = 0.08;
  double height_m = 0.0;  ///< of the tag above the floor, -1 to 5
  /// The tag in base_link: its middle, and its way up (the upright tag's, as it is printed) from the robot's
  /// forward direction, counter-clockwise. Yaw 0: upright for somebody who looks forward. -5 to 5 m.
  Pose2 mounting{};

  friend bool operator==(const TagSpec&, const TagSpec&) = default;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const TagSpec& tag);

/// The families that there are.
const std::vector<std::string_view>& tag_families();
/// How many tags a family has; 0 where there is no such family.
int tag_count(std::string_view family);
/// How many wrong bits are corrected unless the finder is told otherwise: so few that a wrong reading of
/// something that is no tag is rare (Olson 2011, section IV), fewest in the families with few bits.
int default_hamming(std::string_view family);

/// An upright tag, one pixel a cell (CV_8UC1, 0 or 255), with all that belongs to it: also the white rim
/// where the family asks for one.
struct TagPattern {
  cv::Mat cells;
  int border_cells = 8;  ///< between the corners; TagSpec::size_m is their width
};

/// Throws std::invalid_argument naming what is allowed where there is no such family or id.
TagPattern tag_pattern(std::string_view family, int id);

/// Corners of the upright tag, in this order everywhere: top left, top right, bottom right, bottom left.
using TagCorners = std::array<Pixel, 4>;

/// A tag that a picture shows.
struct FoundTag {
  std::string_view family;
  int id = 0;
  int hamming = 0;       ///< bits that were corrected
  TagCorners quad_px{};  ///< as libapriltag found them (unrefined), in our convention
  TagCorners corners_px{};
  /// Of x, y of the first corner, then of the others, px^2.
  Eigen::Matrix<double, 8, 8> covariance = Eigen::Matrix<double, 8, 8>::Identity();
  double score = 0.0;  ///< 0 to 1: correlation of the picture with the tag's pattern
};

struct TagFinderConfig {
  /// Corrected bits at most, 0 to 2 (16h5: never any; Standard41h12: at most 1); none: default_hamming().
  std::optional<int> max_hamming;
  double min_score = 0.82;  ///< of what counts as a tag, 0 to 1
};

/// Where and how to look.
struct TagLook {
  cv::Rect part;         ///< of the picture; cut to it
  double edge_px = 0.0;  ///< expected edge of the smallest tag, > 0: smaller ones are magnified
};

/// Finds the tags of some families. Any number of threads may use one at the same time: each call takes a
/// detector of its own from a pool that grows to as many as were ever in use together.
class TagFinder {
 public:
  /// Throws std::invalid_argument for no family, one that there is not, or settings out of range.
  explicit TagFinder(const std::vector<std::string>& families, const TagFinderConfig& config = {});
  ~TagFinder();
  TagFinder(TagFinder&&) noexcept;
  TagFinder& operator=(TagFinder&&) noexcept;

  /// `image`: CV_8UC1 or CV_8UC3. By family and id, then place: the answer depends on nothing else. Empty for
  /// a part of less than 8 px a side.
  std::vector<FoundTag> find(const cv::Mat& image, const TagLook& look) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight
