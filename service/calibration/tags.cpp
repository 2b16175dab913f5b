#include "service/calibration/tags.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/dictionaries.hpp"

namespace skylight::calibration {
namespace {

/// Smallest tags that are looked for: perimeter over the picture's longer side.
constexpr double kSmallest = 0.015;
/// Edges are sampled between these shares of their length, away from the rounded corners.
constexpr double kFrom = 0.12;
constexpr double kTo = 0.88;
/// Across an edge, px: as far as a border cell allows, in steps of.
constexpr double kWidest = 4.0;
constexpr double kAcross = 0.25;
constexpr int kRounds = 2;

double at(const cv::Mat& grey, double x, double y) {
  const double cx = std::clamp(x, 0.0, grey.cols - 1.001);
  const double cy = std::clamp(y, 0.0, grey.rows - 1.001);
  const int u = static_cast<int>(cx);
  const int v = static_cast<int>(cy);
  const double fx = cx - u;
  const double fy = cy - v;
  const auto* top = grey.ptr<std::uint8_t>(v);
  const auto* bottom = grey.ptr<std::uint8_t>(v + 1);
  return (1 - fy) * ((1 - fx) * top[u] + fx * top[u + 1]) + fy * ((1 - fx) * bottom[u] + fx * bottom[u + 1]);
}

/// Where, along `outward` from `start`, the picture turns from dark to light: the middle of the rise.
std::optional<Pixel> rise(const cv::Mat& grey, const Pixel& start, const Eigen::Vector2d& outward,
                          double reach) {
  double sum = 0.0;
  double weighted = 0.0;
  const int steps = static_cast<int>(reach / kAcross);
  for (int i = -steps; i < steps; ++i) {
    const Pixel from = start + i * kAcross * outward;
    const Pixel to = from + kAcross * outward;
    const double gain = std::max(0.0, at(grey, to.x(), to.y()) - at(grey, from.x(), from.y()));
    sum += gain;
    weighted += gain * (i + 0.5) * kAcross;
  }
  if (!(sum > 10.0)) return std::nullopt;
  return Pixel(start + weighted / sum * outward);
}

/// A line n^T p = d.
struct Line {
  Eigen::Vector2d normal;
  double distance = 0.0;
};

std::optional<Line> line_through(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 4) return std::nullopt;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& point : points) middle += point / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const auto& point : points) spread += (point - middle) * (point - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread);
  const Eigen::Vector2d normal = solver.eigenvectors().col(0);
  return Line{normal, normal.dot(middle)};
}

/// Straight lines are straight in the plane before the lens.
std::optional<Eigen::Vector2d> in_plane(const CameraModel& camera, const Pixel& pixel) {
  const auto ray = camera.ray_from_pixel(pixel);
  if (!ray || !(ray->z() > 0.05)) return std::nullopt;
  return Eigen::Vector2d(ray->head<2>() / ray->z());
}

std::optional<Line> edge(const cv::Mat& grey, const CameraModel& camera, const Pixel& from, const Pixel& to) {
  const Eigen::Vector2d along = to - from;
  const double length = along.norm();
  // Corners run clockwise in the picture: outside is to the left of the way.
  const Eigen::Vector2d outward = Eigen::Vector2d(along.y(), -along.x()) / length;
  const double reach = std::clamp(0.7 * length / 8.0, 1.0, kWidest);
  const int count = std::clamp(static_cast<int>(length), 8, 60);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const Pixel start = from + (kFrom + (kTo - kFrom) * i / (count - 1)) * along;
    const auto pixel = rise(grey, start, outward, reach);
    if (!pixel) continue;
    if (const auto point = in_plane(camera, *pixel)) points.push_back(*point);
  }
  return line_through(points);
}

bool refine(const cv::Mat& grey, const CameraModel& camera, std::array<Pixel, 4>& corners) {
  std::array<Line, 4> lines;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto line = edge(grey, camera, corners[i], corners[(i + 1) % 4]);
    if (!line) return false;
    lines[i] = *line;
  }
  std::array<Pixel, 4> refined;
  for (std::size_t i = 0; i < 4; ++i) {
    const Line& a = lines[(i + 3) % 4];
    const Line& b = lines[i];
    Eigen::Matrix2d normals;
    normals << a.normal.transpose(), b.normal.transpose();
    if (std::abs(normals.determinant()) < 0.1) return false;
    const Eigen::Vector2d cross = normals.inverse() * Eigen::Vector2d(a.distance, b.distance);
    const auto pixel = camera.pixel_from_camera({cross.x(), cross.y(), 1.0});
    if (!pixel || (*pixel - corners[i]).norm() > 2.0 * kWidest) return false;
    refined[i] = *pixel;
  }
  corners = refined;
  return true;
}

/// OpenCV keeps the codes of AprilTag's families turned by half a turn against the tags as they are printed.
std::size_t turned(const std::string& dictionary) {
  return dictionary.starts_with("apriltag_") ? 2 : 0;
}

}  // namespace

std::array<Eigen::Vector2d, 4> tag_points(double size_m) {
  const double half = 0.5 * size_m;
  return {Eigen::Vector2d(-half, half), {half, half}, {half, -half}, {-half, -half}};
}

std::string tag_dictionary(const std::string& family) {
  std::string known;
  for (const std::string& name : dictionary_names()) {
    if (name == family || name == "apriltag_" + family) return name;
    known += (known.empty() ? "" : ", ") + (name.starts_with("apriltag_") ? name.substr(9) : name);
  }
  throw std::invalid_argument("there is no family of tags \"" + family + "\"; there are " + known);
}

std::vector<TagSighting> find_tags(const cv::Mat& image, const std::string& dictionary_name,
                                   const CameraModel& camera) {
  cv::Mat grey = image;
  if (image.channels() != 1) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->minMarkerPerimeterRate = kSmallest;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, dictionary(dictionary_name), corners, ids, parameters);
  std::vector<TagSighting> out;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    TagSighting tag{.id = ids[i], .corners = {}};
    for (std::size_t k = 0; k < 4; ++k) {
      const cv::Point2f& corner = corners[i][(k + turned(dictionary_name)) % 4];
      tag.corners[k] = Pixel(corner.x, corner.y);
    }
    bool good = true;
    for (int round = 0; round < kRounds && good; ++round) good = refine(grey, camera, tag.corners);
    if (good) out.push_back(tag);
  }
  std::sort(out.begin(), out.end(), [](const TagSighting& a, const TagSighting& b) { return a.id < b.id; });
  return out;
}

}  // namespace skylight::calibration
