#include "tracker/detect/correlate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace skylight {
namespace {

using Eigen::Vector2d;

constexpr int kMaxCells = 200;

cv::Mat blurred(const cv::Mat& image, double sigma_px) {
  if (sigma_px < 0.3) return image;
  cv::Mat out;
  cv::GaussianBlur(image, out, {}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  return out;
}

// The plane as a grid of cells, row = x, column = y; cells that the camera does not see are NaN.
struct Grid {
  std::vector<cv::Mat> planes;  // CV_32FC1
  Vector2d first_m;             // centre of cell (0, 0)
};

Grid rectify(const Frame& frame, const CameraModel& camera, const FloorPart& part, double height_m,
             const CorrelateModel& model) {
  const int half = std::min(kMaxCells / 2, static_cast<int>(std::ceil(part.half_side_m / model.cell_m)));
  const int n = 2 * half + 1;
  Grid grid;
  grid.first_m = part.centre_m - Vector2d::Constant(half * model.cell_m);
  cv::Mat map(n, n, CV_32FC2, cv::Scalar(-1e6, -1e6));
  cv::Rect2d seen;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const auto pixel = camera.pixel_from_map(
          {grid.first_m.x() + i * model.cell_m, grid.first_m.y() + j * model.cell_m, height_m});
      if (!pixel || !camera.sees(*pixel)) continue;
      map.at<cv::Vec2f>(i, j) = {static_cast<float>(pixel->x()), static_cast<float>(pixel->y())};
      seen = seen.empty() ? cv::Rect2d(pixel->x(), pixel->y(), 1, 1)
                          : seen | cv::Rect2d(pixel->x(), pixel->y(), 1, 1);
    }
  }
  if (seen.empty()) return grid;
  Eigen::Matrix2d metres_by_px;
  const Pixel middle(seen.x + seen.width / 2, seen.y + seen.height / 2);
  if (!camera.plane_from_pixel(middle, height_m, &metres_by_px)) return grid;
  const double metres_per_px = std::sqrt(std::abs(metres_by_px.determinant()));

  const cv::Rect roi =
      cv::Rect(cv::Point(static_cast<int>(seen.x) - 4, static_cast<int>(seen.y) - 4),
               cv::Size(static_cast<int>(seen.width) + 9, static_cast<int>(seen.height) + 9)) &
      cv::Rect({}, frame.image.size());
  cv::Mat image = frame.image(roi);
  if (model.channels == 1 && image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
  image.convertTo(image, CV_32F);
  image = blurred(image, 0.5 * model.cell_m / metres_per_px);
  map -= cv::Scalar(roi.x, roi.y);
  cv::Mat values;
  cv::remap(image, values, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT,
            cv::Scalar::all(std::nan("")));
  cv::split(values, grid.planes);
  return grid;
}

// The disc around cell (i, j), channel after channel, each less its mean; none where it is not all seen.
bool read_disc(const Grid& grid, const CorrelateModel& model, int i, int j, Eigen::Ref<Eigen::VectorXf> out) {
  const auto n = static_cast<Eigen::Index>(model.cells.size());
  for (std::size_t c = 0; c < grid.planes.size(); ++c) {
    auto values = out.segment(static_cast<Eigen::Index>(c) * n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Eigen::Vector2i& cell = model.cells[static_cast<std::size_t>(k)];
      values[k] = grid.planes[c].at<float>(i + cell.x(), j + cell.y());
    }
    values.array() -= values.mean();
  }
  return std::isfinite(out.sum());
}

struct Place {
  int i = 0;
  int j = 0;
  float contrast = 0.0F;
};

// Places whose disc has the most contrast, apart from each other by the disc's radius.
std::vector<Place> conspicuous(const Grid& grid, const CorrelateModel& model, int count) {
  const int r = model.radius_cells;
  const int rows = grid.planes[0].rows;
  const int cols = grid.planes[0].cols;
  std::vector<Place> all;
  Eigen::VectorXf disc(model.discs.rows());
  for (int i = r; i < rows - r; i += 2) {
    for (int j = r; j < cols - r; j += 2) {
      if (read_disc(grid, model, i, j, disc)) all.push_back({i, j, disc.norm()});
    }
  }
  std::sort(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.contrast > b.contrast; });
  std::vector<Place> chosen;
  for (const Place& place : all) {
    const bool apart = std::none_of(chosen.begin(), chosen.end(), [&](const Place& other) {
      return std::hypot(place.i - other.i, place.j - other.j) < 1.5 * r;
    });
    if (apart) chosen.push_back(place);
    if (static_cast<int>(chosen.size()) >= count) break;
  }
  return chosen;
}

// The best heading and offset around one place.
CorrelatePose best_around(const Grid& grid, const CorrelateModel& model, const Place& place) {
  CorrelatePose best;
  const int r = model.radius_cells;
  Eigen::VectorXf disc(model.discs.rows());
  for (int i = std::max(r, place.i - r); i <= std::min(grid.planes[0].rows - 1 - r, place.i + r); ++i) {
    for (int j = std::max(r, place.j - r); j <= std::min(grid.planes[0].cols - 1 - r, place.j + r); ++j) {
      if (!read_disc(grid, model, i, j, disc) || disc.norm() < 1e-3F) continue;
      Eigen::Index heading = 0;
      const double score = (model.discs.transpose() * disc).maxCoeff(&heading) / disc.norm();
      if (score <= best.score) continue;
      best.score = score;
      best.pose = {grid.first_m.x() + i * model.cell_m, grid.first_m.y() + j * model.cell_m,
                   model.yaw[static_cast<std::size_t>(heading)]};
    }
  }
  return best;
}

}  // namespace

CorrelateModel make_correlate_model(const Appearance& appearance, const CorrelateConfig& config) {
  CorrelateModel model;
  model.channels = appearance.values().channels();
  model.cell_m = appearance.size_m().minCoeff() / config.cells;
  model.radius_cells = config.cells / 2;
  const int r = model.radius_cells;
  for (int i = -r; i <= r; ++i) {
    for (int j = -r; j <= r; ++j) {
      if (std::hypot(i, j) <= r - 0.25) model.cells.emplace_back(i, j);
    }
  }
  const double metres_per_pixel = appearance.picture().metres_per_pixel;
  std::vector<cv::Mat> planes;
  cv::split(blurred(appearance.values(), 0.5 * model.cell_m / metres_per_pixel), planes);
  const auto n = static_cast<Eigen::Index>(model.cells.size());
  model.discs.resize(n * model.channels, config.headings);
  for (int h = 0; h < config.headings; ++h) {
    const double yaw = wrap_angle(2.0 * std::numbers::pi * h / config.headings);
    const Eigen::Rotation2Dd robot_from_map(-yaw);
    model.yaw.push_back(yaw);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vector2d at =
          robot_from_map * (model.cells[static_cast<std::size_t>(k)].cast<double>() * model.cell_m);
      const int row = static_cast<int>(std::lround((planes[0].rows - 1) / 2.0 - at.x() / metres_per_pixel));
      const int column =
          static_cast<int>(std::lround((planes[0].cols - 1) / 2.0 - at.y() / metres_per_pixel));
      for (int c = 0; c < model.channels; ++c) {
        model.discs(c * n + k, h) = planes[static_cast<std::size_t>(c)].at<float>(
            std::clamp(row, 0, planes[0].rows - 1), std::clamp(column, 0, planes[0].cols - 1));
      }
    }
    for (int c = 0; c < model.channels; ++c) {
      auto channel = model.discs.col(h).segment(c * n, n);
      channel.array() -= channel.mean();
    }
    if (const float norm = model.discs.col(h).norm(); norm > 0.0F) model.discs.col(h) /= norm;
  }
  return model;
}

std::vector<CorrelatePose> find_correlate(const CorrelateModel& model, const Appearance& appearance,
                                          const Frame& frame, const CameraModel& camera,
                                          const FloorPart& part, double surface_height_m,
                                          const CorrelateConfig& config) {
  std::vector<CorrelatePose> found;
  if (model.channels == 3 && frame.image.channels() == 1) return found;  // colour was what told this picture
  const Grid grid = rectify(frame, camera, part, surface_height_m, model);
  if (grid.planes.empty()) return found;
  for (const Place& place : conspicuous(grid, model, config.places)) {
    CorrelatePose best = best_around(grid, model, place);
    if (best.score < config.min_score) continue;
    const Vector2d base = best.pose.position() - Eigen::Rotation2Dd(best.pose.yaw) * appearance.centre_m();
    best.pose.x = base.x();
    best.pose.y = base.y();
    found.push_back(best);
  }
  std::sort(found.begin(), found.end(),
            [](const CorrelatePose& a, const CorrelatePose& b) { return a.score > b.score; });
  return found;
}

}  // namespace skylight
