#include "tracker/depth/floor_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include <Eigen/Cholesky>

namespace skylight {
namespace {

constexpr int kSamples = 8000;       // cells that are looked at when learning, about
constexpr int kBlocks = 8;           // across and down, for what lasts
constexpr int kFewest = 20;          // samples of a block that are worth a mean
constexpr double kLeastShare = 0.3;  // of the floor that has to be seen
constexpr double kTukey = 4.685;     // Tukey's constant: 95 % efficient for normal noise
constexpr int kFirstRounds = 8;
constexpr double kLargestError = 0.15;  // lasting error over distance: a floor that far off is another thing

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::string check(const DepthConfig& config) {
  std::ostringstream text;
  const auto range = [&text](const char* field, double value, double min, double max) {
    if (text.tellp() == 0 && !(value >= min && value <= max))
      text << "depth." << field << " is " << value << ", allowed " << min << " to " << max;
  };
  range("cell_px", config.cell_px, 2, 32);
  range("learn_frames", config.learn_frames, 1, 1000);
  range("follow_frames", config.follow_frames, config.learn_frames, 100000);
  range("follow_interval", config.follow_interval, 1, 1000);
  range("tolerance_m", config.tolerance_m, 0.001, 1.0);
  range("sigmas", config.sigmas, 1.0, 10.0);
  range("covered_share", config.covered_share, 0.05, 1.0);
  return text.str();
}

FloorDepth::FloorDepth(const CameraModel& camera, const DepthConfig& config)
    : camera_(camera), config_(config) {
  if (const std::string wrong = check(config); !wrong.empty()) throw std::invalid_argument(wrong);
  const int side = config.cell_px;
  cells_ = {camera.intrinsics().width_px / side, camera.intrinsics().height_px / side};
  camera_height_m_ = camera.map_from_camera().translation().z();
  const Eigen::RowVector3d up_by_camera = camera.map_from_camera().linear().row(2);
  inverse_floor_.reserve(static_cast<std::size_t>(cells_.area()));
  double nearest = std::numeric_limits<double>::infinity();
  for (int row = 0; row < cells_.height; ++row) {
    for (int column = 0; column < cells_.width; ++column) {
      const auto ray =
          camera.ray_from_pixel({column * side + (side - 1) / 2.0, row * side + (side - 1) / 2.0});
      // Down to the floor goes c = -z (R ray / ray.z).z.
      const double fall = ray && ray->z() > 0.0 ? -up_by_camera.dot(*ray) / ray->z() : 0.0;
      const bool meets = fall > 0.0 && camera_height_m_ > 0.0;
      inverse_floor_.push_back(meets ? static_cast<float>(fall / camera_height_m_) : 0.0F);
      const double from_middle = std::hypot(column - cells_.width / 2.0, row - cells_.height / 2.0);
      if (!meets || from_middle >= nearest) continue;
      nearest = from_middle;
      floor_m_ = camera_height_m_ / fall;
    }
  }
}

FloorDepth::Terms FloorDepth::terms(double column_px, double row_px) const {
  const double x = 2.0 * column_px / camera_.intrinsics().width_px - 1.0;
  const double y = 2.0 * row_px / camera_.intrinsics().height_px - 1.0;
  return (Terms() << 1.0, x, y, x * x, x * y, y * y).finished();
}

double FloorDepth::correction(double column_px, double row_px) const {
  return correction_.dot(terms(column_px, row_px));
}

/// Mean of the readings at four places of the cell, metres; 0 where there are less than two.
float FloorDepth::cell_depth(const cv::Mat& depth, int column, int row) const {
  const int side = config_.cell_px;
  const int near = side / 4;
  const int far = side - 1 - near;
  const auto* upper = depth.ptr<std::uint16_t>(row * side + near) + column * side;
  const auto* lower = depth.ptr<std::uint16_t>(row * side + far) + column * side;
  const std::array<int, 4> readings{upper[near], upper[far], lower[near], lower[far]};
  int sum = 0;
  int count = 0;
  for (const int reading : readings) {
    sum += reading;
    count += reading > 0 ? 1 : 0;
  }
  return count < 2 ? 0.0F : 0.001F * static_cast<float>(sum) / static_cast<float>(count);
}

float FloorDepth::height(const cv::Mat& depth, int column, int row) const {
  const float floor = inverse_floor_[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells_.width) +
                                     static_cast<std::size_t>(column)];
  const float z = cell_depth(depth, column, row);
  if (floor <= 0.0F || z <= 0.0F) return std::numeric_limits<float>::quiet_NaN();
  const double middle = (config_.cell_px - 1) / 2.0;
  const double inverse =
      1.0 / z - correction(column * config_.cell_px + middle, row * config_.cell_px + middle);
  return static_cast<float>(camera_height_m_ * (1.0 - floor / inverse));
}

float FloorDepth::height(const cv::Mat& depth, const Pixel& pixel) const {
  const int column = static_cast<int>(std::floor((pixel.x() + 0.5) / config_.cell_px));
  const int row = static_cast<int>(std::floor((pixel.y() + 0.5) / config_.cell_px));
  if (column < 0 || row < 0 || column >= cells_.width || row >= cells_.height)
    return std::numeric_limits<float>::quiet_NaN();
  return height(depth, column, row);
}

double FloorDepth::sigma_m(double height_m) const {
  const double share = camera_height_m_ > 0.0 ? 1.0 - height_m / camera_height_m_ : 1.0;
  return camera_height_m_ * floor_m_ * share * share * noise_;
}

double FloorDepth::corrected(const Pixel& pixel, double z_m) const {
  return fit_.known ? 1.0 / (1.0 / z_m - correction(pixel.x(), pixel.y())) : z_m;
}

std::vector<FloorDepth::Sample> FloorDepth::samples(const cv::Mat& depth) const {
  std::vector<Sample> out;
  out.reserve(2 * kSamples);
  const int step = std::max(1, static_cast<int>(std::sqrt(cells_.area() / static_cast<double>(kSamples))));
  const double middle = (config_.cell_px - 1) / 2.0;
  // Each look begins elsewhere, so that in time all cells are looked at.
  const int first_row = static_cast<int>(seen_ % static_cast<std::uint64_t>(step));
  const int first_column =
      static_cast<int>(seen_ / static_cast<std::uint64_t>(step) % static_cast<std::uint64_t>(step));
  for (int row = first_row; row < cells_.height; row += step) {
    for (int column = first_column; column < cells_.width; column += step) {
      const float floor =
          inverse_floor_[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells_.width) +
                         static_cast<std::size_t>(column)];
      const float z = floor > 0.0F ? cell_depth(depth, column, row) : 0.0F;
      if (z <= 0.0F) continue;
      out.push_back({terms(column * config_.cell_px + middle, row * config_.cell_px + middle),
                     1.0 / static_cast<double>(z) - static_cast<double>(floor),
                     kBlocks * (kBlocks * row / cells_.height) + kBlocks * column / cells_.width});
    }
  }
  return out;
}

void FloorDepth::learn(const cv::Mat& depth) {
  const bool learnt = fit_.known && fit_.frames >= config_.learn_frames;
  if (learnt && ++seen_ % static_cast<std::uint64_t>(config_.follow_interval) != 0) return;
  if (!learnt) ++seen_;
  const std::vector<Sample> floor = samples(depth);
  if (static_cast<int>(floor.size()) < kBlocks * kFewest) return;
  // What was taken for the floor was none: from the beginning.
  if (!fit_.known && fit_.frames >= 2 * config_.learn_frames) fit_.frames = 0;
  if (fit_.frames == 0) begin(floor);
  const int frames = std::min(fit_.frames + 1, config_.follow_frames);
  weigh(floor, 1.0 - 1.0 / frames);
  ++fit_.frames;
  spread(floor);
}

/// From nothing: the floor is what most of the picture shows.
void FloorDepth::begin(const std::vector<Sample>& samples) {
  std::vector<double> rest;
  rest.reserve(samples.size());
  for (const Sample& sample : samples) rest.push_back(sample.rest);
  correction_.setZero();
  correction_(0) = median(rest);
  for (int round = 0; round < kFirstRounds; ++round) {
    rest.clear();
    for (const Sample& sample : samples)
      rest.push_back(std::abs(sample.rest - correction_.dot(sample.terms)));
    noise_ = std::max(1.4826 * median(rest), 1e-9);
    weigh(samples, 0.0);
  }
}

/// One round of least squares, what was learnt before counting `keep` times.
void FloorDepth::weigh(const std::vector<Sample>& samples, double keep) {
  normal_ *= keep;
  right_ *= keep;
  const double reach = kTukey * std::max(noise_, 1e-7);
  for (const Sample& sample : samples) {
    const double off = (sample.rest - correction_.dot(sample.terms)) / reach;
    if (std::abs(off) >= 1.0) continue;
    const double weight = (1.0 - off * off) * (1.0 - off * off);
    normal_ += weight * sample.terms * sample.terms.transpose();
    right_ += weight * sample.rest * sample.terms;
  }
  // A floor of which only a strip is seen leaves terms open: they stay near nought.
  const Eigen::Matrix<double, kTerms, kTerms> held =
      normal_ + 1e-4 * normal_(0, 0) * Eigen::Matrix<double, kTerms, kTerms>::Identity();
  if (normal_(0, 0) > 0.0) correction_ = held.ldlt().solve(right_);
}

/// What the correction leaves: noise from cell to cell, and what whole parts of the floor have in common.
void FloorDepth::spread(const std::vector<Sample>& samples) {
  std::vector<double> size;
  size.reserve(samples.size());
  for (const Sample& sample : samples) size.push_back(std::abs(sample.rest - correction_.dot(sample.terms)));
  std::vector<double> sorted = size;
  const double now = std::max(1.4826 * median(sorted), 1e-9);
  const double share = 1.0 / std::min(fit_.frames, config_.follow_frames);
  noise_ += share * (now - noise_);
  std::array<double, kBlocks * kBlocks> sum{};
  std::array<int, kBlocks * kBlocks> count{};
  std::size_t inliers = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (size[i] > config_.sigmas * noise_) continue;
    ++inliers;
    const auto block = static_cast<std::size_t>(samples[i].block);
    sum[block] += samples[i].rest - correction_.dot(samples[i].terms);
    ++count[block];
  }
  double squares = 0.0;
  int blocks = 0;
  for (std::size_t block = 0; block < sum.size(); ++block) {
    if (count[block] < kFewest) continue;
    const double mean = sum[block] / count[block];
    squares += mean * mean - noise_ * noise_ / count[block];
    ++blocks;
  }
  if (blocks > 0) uneven_variance_ += share * (squares / blocks - uneven_variance_);
  report(inliers, samples.size());
}

void FloorDepth::report(std::size_t inliers, std::size_t samples) {
  // The plane z = offset + slope (x - middle) that fits the floor as the sensor reads it.
  std::vector<Eigen::Vector3d> points;
  constexpr int kAcross = 16;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const Pixel pixel((i % kAcross + 0.5) / kAcross * camera_.intrinsics().width_px,
                      (i / kAcross + 0.5) / kAcross * camera_.intrinsics().height_px);
    const auto at = camera_.plane_from_pixel(pixel, 0.0);
    const auto ray = camera_.ray_from_pixel(pixel);
    if (!at || !ray || ray->z() <= 0.0) continue;
    const double floor = -camera_.map_from_camera().linear().row(2).dot(*ray) / ray->z() / camera_height_m_;
    points.emplace_back(at->x(), at->y(),
                        camera_height_m_ * (1.0 - floor / (floor + correction(pixel.x(), pixel.y()))));
  }
  if (points.empty()) return;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) middle += point / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Identity() * 1e-9;
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d from = point - middle;
    spread += from.head<2>() * from.head<2>().transpose();
    rise += from.z() * from.head<2>();
  }
  const Eigen::Vector2d slope = spread.ldlt().solve(rise);
  double bend = 0.0;
  for (const Eigen::Vector3d& point : points)
    bend += std::pow(point.z() - middle.z() - slope.dot((point - middle).head<2>()), 2);
  const double by_inverse = camera_height_m_ * floor_m_;  // metres of height by 1/m
  fit_.share = static_cast<double>(inliers) / static_cast<double>(std::max<std::size_t>(samples, 1));
  fit_.offset_m = middle.z();
  fit_.tilt_rad = std::atan(slope.norm());
  fit_.bend_m = std::sqrt(bend / static_cast<double>(points.size()));
  fit_.noise_m = by_inverse * noise_;
  fit_.uneven_m = by_inverse * std::sqrt(std::max(uneven_variance_, 0.0));
  fit_.known = fit_.frames >= config_.learn_frames && fit_.share >= kLeastShare &&
               std::abs(fit_.offset_m) < kLargestError * camera_height_m_;
}

}  // namespace skylight
