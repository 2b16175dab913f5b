#include "tracker/detect/apriltag_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

namespace skylight {
namespace {

constexpr int kUnknowns = 10;       // the homography's eight, gain, level
constexpr int kMostSamples = 3600;  // more of a large tag add little
constexpr double kLargest = 50.0;   // px, of a whole tag as it is fitted
constexpr int kLeastSamples = 60;   // of an 8 x 8 px tag
constexpr int kMostIterations = 12;
constexpr double kConverged = 2e-3;      // px, of the corner that moved farthest
constexpr double kFarthestCells = 1.5;   // that a corner may move from where libapriltag saw it
constexpr double kHuber = 2.5;           // standard deviations
constexpr double kBoxSigma = 0.2886751;  // of a box of width 1: variance 1/12
constexpr std::array kLensSigmas{0.04, 0.25, 0.45, 0.75, 1.2, 1.7};  // px, tried in turn
constexpr double kSharedNoise = 1.4;  // neighbouring pixels err together: demosaicing, the blur's true shape
constexpr double kCornerFloor = 0.006;  // px per corner, however little the noise,
constexpr double kCommonFloor = 0.004;  // px of all corners together,
constexpr double kPrintFloor = 3e-4;    // and both as a share of the edge: nothing is printed exactly

using Row10 = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Homography = Eigen::Matrix3d;
const std::array<Eigen::Vector2d, 4> kUnitCorners{Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1),
                                                  Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1)};

/// Standard normal distribution function and density, from a table: the fit asks for some 10^5 of them.
class Normals {
 public:
  Normals() {
    for (int i = 0; i < kSteps + 2; ++i) {
      const double x = -kReach + i * kStep;
      below_[static_cast<std::size_t>(i)] = 0.5 * std::erfc(-x / std::numbers::sqrt2);
      density_[static_cast<std::size_t>(i)] = std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
    }
  }
  double below(double x) const {
    if (x <= -kReach) return 0.0;
    if (x >= kReach) return 1.0;
    return read(below_, x);
  }
  double density(double x) const { return std::abs(x) >= kReach ? 0.0 : read(density_, x); }

 private:
  static constexpr int kSteps = 2048;
  static constexpr double kReach = 4.5;
  static constexpr double kStep = 2.0 * kReach / kSteps;
  using Table = std::array<double, kSteps + 2>;
  static double read(const Table& table, double x) {
    const double place = (x + kReach) / kStep;
    const auto i = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(i);
    return (1.0 - share) * table[i] + share * table[i + 1];
  }
  Table below_{}, density_{};
};

const Normals kNormals;

/// What a pixel sees along one axis of the tag, in cells: its square, which is a box where it lies along the
/// axis and nearly a bell where it lies across, blurred by the lens.
struct Footprint {
  double box = 0.0;    ///< width
  double sigma = 0.1;  ///< of the bell that it is blurred with

  double reach() const { return 0.5 * box + 3.5 * sigma; }
  /// Share of it below x from its middle, and how that grows with x.
  std::pair<double, double> below(double x) const {
    const double high = (x + 0.5 * box) / sigma;
    const double low = (x - 0.5 * box) / sigma;
    const double high_below = kNormals.below(high);
    const double low_below = kNormals.below(low);
    // The integral of the normal distribution function is z below(z) + density(z).
    const double area = high * high_below + kNormals.density(high) - low * low_below - kNormals.density(low);
    return {area * sigma / box, (high_below - low_below) / box};
  }
};

/// How much of each cell along one axis a look at `u` (in cells) takes in, and its change with u.
struct Shares {
  int first = 0;
  int count = 0;
  std::array<double, 64> share{}, slope{};

  Shares(double u, const Footprint& footprint, int cells) {
    const double reach = footprint.reach();
    first = std::clamp(static_cast<int>(std::floor(u - reach)), 0, cells - 1);
    const int last = std::clamp(static_cast<int>(std::floor(u + reach)), first, cells - 1);
    count = std::min(last - first + 1, static_cast<int>(share.size()));
    double below = 0.0;
    double density = 0.0;
    for (int k = 0; k < count; ++k) {
      // What lies beyond the outermost cells counts as they do.
      const auto [next_below, next_density] =
          k + 1 == count ? std::pair(1.0, 0.0) : footprint.below(first + k + 1 - u);
      share[static_cast<std::size_t>(k)] = next_below - below;
      slope[static_cast<std::size_t>(k)] = density - next_density;
      below = next_below;
      density = next_density;
    }
  }
};

struct Level {
  double value = 0.0;               ///< 0 black, 1 white
  Eigen::Vector2d slope{0.0, 0.0};  ///< per cell
};

Level blurred(const cv::Mat& cells, const Eigen::Vector2d& at, const std::array<Footprint, 2>& footprint) {
  const Shares across(at.x(), footprint[0], cells.cols);
  const Shares down(at.y(), footprint[1], cells.rows);
  Level level;
  for (int i = 0; i < down.count; ++i) {
    const auto* row = cells.ptr<std::uint8_t>(down.first + i) + across.first;
    double value = 0.0;
    double slope = 0.0;
    for (int k = 0; k < across.count; ++k) {
      if (row[k] == 0) continue;
      value += across.share[static_cast<std::size_t>(k)];
      slope += across.slope[static_cast<std::size_t>(k)];
    }
    level.value += down.share[static_cast<std::size_t>(i)] * value;
    level.slope.x() += down.share[static_cast<std::size_t>(i)] * slope;
    level.slope.y() += down.slope[static_cast<std::size_t>(i)] * value;
  }
  return level;
}

/// From the corners at (+-1, +-1) to these places: eight linear equations.
std::optional<Homography> homography_to(const std::array<Eigen::Vector2d, 4>& places) {
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& q = kUnitCorners[static_cast<std::size_t>(i)];
    const Eigen::Vector2d& p = places[static_cast<std::size_t>(i)];
    a.row(2 * i) << q.x(), q.y(), 1, 0, 0, 0, -p.x() * q.x(), -p.x() * q.y();
    a.row(2 * i + 1) << 0, 0, 0, q.x(), q.y(), 1, -p.y() * q.x(), -p.y() * q.y();
    b.segment<2>(2 * i) = p;
  }
  const Eigen::FullPivLU<Eigen::Matrix<double, 8, 8>> solver(a);
  if (!solver.isInvertible()) return std::nullopt;
  const Eigen::Matrix<double, 8, 1> h = solver.solve(b);
  Homography result;
  result << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0;
  return result;
}

Eigen::Vector2d mapped(const Homography& h, const Eigen::Vector2d& q) {
  return (h * q.homogeneous()).hnormalized();
}

/// d(place)/d(the homography's first eight entries) at q.
Eigen::Matrix<double, 2, 8> by_homography(const Homography& h, const Eigen::Vector2d& q) {
  const double w = h(2, 0) * q.x() + h(2, 1) * q.y() + h(2, 2);
  const Eigen::Vector2d p = mapped(h, q);
  Eigen::Matrix<double, 2, 8> d;
  d << q.x(), q.y(), 1, 0, 0, 0, -p.x() * q.x(), -p.x() * q.y(),  //
      0, 0, 0, q.x(), q.y(), 1, -p.y() * q.x(), -p.y() * q.y();
  return d / w;
}

/// d(place)/d(q).
Eigen::Matrix2d by_place(const Homography& h, const Eigen::Vector2d& q) {
  const double w = h(2, 0) * q.x() + h(2, 1) * q.y() + h(2, 2);
  const Eigen::Vector2d p = mapped(h, q);
  return (h.topLeftCorner<2, 2>() - p * h.block<1, 2>(2, 0)) / w;
}

struct Sample {
  Eigen::Vector2d at;  ///< in the fit's own unit
  double grey = 0.0;
};

/// What is fitted, and what goes with it.
struct State {
  Homography homography = Homography::Identity();
  double gain = 0.0;
  double level = 0.0;
  double blur = kLensSigmas[0];  ///< px, standard deviation
  double noise = 1.0;            ///< grey levels
};

class Fit {
 public:
  Fit(const cv::Mat& grey, const TagPattern& pattern, const TagCorners& corners)
      : pattern_(pattern), half_(0.5 * pattern.border_cells), begun_(corners) {
    centre_ = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
    for (const Pixel& corner : corners) unit_ = std::max(unit_, (corner - centre_).norm());
    std::array<Eigen::Vector2d, 4> places;
    for (std::size_t i = 0; i < 4; ++i) places[i] = (corners[i] - centre_) / unit_;
    const auto start = homography_to(places);
    if (!start) return;
    now_.homography = *start;
    gather(grey);
  }

  bool enough() const { return samples_.size() >= static_cast<std::size_t>(kLeastSamples); }

  /// Takes the blur that the picture fits best as things stand; true where that is another one than before.
  bool choose_blur() {
    const double before = now_.blur;
    double least = -1.0;
    double best = now_.blur;
    for (const double lens : kLensSigmas) {
      now_.blur = lens;
      const double cost = solve_light();
      if (least >= 0.0 && cost >= least) break;  // it only grows from here
      least = cost;
      best = now_.blur;
    }
    now_.blur = best;
    solve_light();
    return best != before;
  }

  /// False where it does not come to rest.
  bool run() {
    double damping = 1e-4;
    Step at = look();
    for (int i = 0; i < kMostIterations; ++i) {
      Normal normal = at.normal;
      normal.diagonal() *= 1.0 + damping;
      const Row10 step = normal.ldlt().solve(at.gradient);
      const State before = now_;
      move(step);
      const Step there = look();
      if (!(there.cost < at.cost)) {
        now_ = before;
        if (largest_move(step) < kConverged || damping > 1e3) break;
        damping *= 10.0;
        continue;
      }
      at = there;
      damping *= 0.2;
      if (largest_move(step) < kConverged) break;
    }
    return std::isfinite(at.cost);
  }

  std::optional<TagFit> result() const {
    const Step at = look();
    TagFit fit;
    Eigen::Matrix<double, 8, 8> by_unknown;
    const double cell = 2.0 * unit_ / (std::numbers::sqrt2 * pattern_.border_cells);
    for (std::size_t i = 0; i < 4; ++i) {
      fit.corners_px[i] = centre_ + unit_ * mapped(now_.homography, kUnitCorners[i]);
      if (!((fit.corners_px[i] - begun_[i]).norm() <= kFarthestCells * cell)) return std::nullopt;
      by_unknown.middleRows<2>(2 * static_cast<int>(i)) =
          unit_ * by_homography(now_.homography, kUnitCorners[i]);
    }
    const Normal inverse = at.normal.ldlt().solve(Normal::Identity());
    const double noise = kSharedNoise * at.sum_of_squares / static_cast<double>(samples_.size() - kUnknowns);
    fit.covariance = noise * by_unknown * inverse.topLeftCorner<8, 8>() * by_unknown.transpose();
    const double print = kPrintFloor * cell * pattern_.border_cells;
    fit.covariance.diagonal().array() += kCornerFloor * kCornerFloor + print * print;
    for (int i = 0; i < 8; ++i) {
      for (int k = i % 2; k < 8; k += 2) fit.covariance(i, k) += kCommonFloor * kCommonFloor + print * print;
    }
    fit.score = correlation();
    if (!fit.covariance.allFinite() || now_.gain <= 0.0) return std::nullopt;
    return fit;
  }

 private:
  struct Step {
    Normal normal = Normal::Zero();
    Row10 gradient = Row10::Zero();
    double cost = 0.0;            ///< robust
    double sum_of_squares = 0.0;  ///< weighted
  };

  /// Pixels that show the tag alone, as far as one sees from here.
  void gather(const cv::Mat& grey) {
    const Homography back = now_.homography.inverse();
    const double cell_px = 2.0 * unit_ / (std::numbers::sqrt2 * pattern_.border_cells);
    const double whole = 0.5 * pattern_.cells.cols - 0.6 / cell_px;  // in cells from the middle
    const double reach = std::max(whole, half_ + 0.3) / half_;
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& corner : kUnitCorners)
      box.extend(centre_ + unit_ * mapped(now_.homography, reach * corner));
    if (!box.min().allFinite() || !box.max().allFinite()) return;
    const cv::Rect2d bounds(box.min().x(), box.min().y(), box.sizes().x(), box.sizes().y());
    const cv::Rect part =
        cv::Rect(cv::Point(static_cast<int>(std::floor(std::max(bounds.x, 0.0))),
                           static_cast<int>(std::floor(std::max(bounds.y, 0.0)))),
                 cv::Point(static_cast<int>(std::min(box.max().x() + 1.0, 1.0 * grey.cols)),
                           static_cast<int>(std::min(box.max().y() + 1.0, 1.0 * grey.rows))));
    if (part.width <= 0 || part.height <= 0) return;
    const int stride = 1 + static_cast<int>(std::sqrt(part.area() / static_cast<double>(kMostSamples)));
    for (int v = part.y; v < part.y + part.height; v += stride) {
      for (int u = part.x + (v / stride % 2) * (stride / 2); u < part.x + part.width; u += stride) {
        const Eigen::Vector2d at = (Eigen::Vector2d(u, v) - centre_) / unit_;
        const Eigen::Vector3d q = back * at.homogeneous();
        if (!(q.z() > 1e-6 || q.z() < -1e-6)) continue;
        if (q.hnormalized().cwiseAbs().maxCoeff() > reach) continue;
        samples_.push_back({at, static_cast<double>(grey.at<std::uint8_t>(v, u))});
      }
    }
  }

  struct Seen {
    Level level;
    Eigen::Vector2d q;
    Eigen::Matrix2d cells_by_place;  ///< d(cells)/d(place in the fit's unit)
  };

  Seen see(const Homography& back, const Sample& sample) const {
    Seen seen;
    seen.q = mapped(back, sample.at);
    seen.cells_by_place = half_ * by_place(now_.homography, seen.q).inverse();
    std::array<Footprint, 2> footprint;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::RowVector2d pixel = seen.cells_by_place.row(axis).cwiseAbs() / unit_;
      const double across = pixel.minCoeff();
      footprint[static_cast<std::size_t>(axis)] = {
          pixel.maxCoeff(),
          std::sqrt(now_.blur * now_.blur * pixel.squaredNorm() + kBoxSigma * kBoxSigma * across * across)};
    }
    const Eigen::Vector2d middle(0.5 * pattern_.cells.cols, 0.5 * pattern_.cells.rows);
    seen.level = blurred(pattern_.cells, middle + half_ * seen.q, footprint);
    return seen;
  }

  /// Gain and level for the homography as it is; returns the sum of squares.
  double solve_light() {
    const Homography back = now_.homography.inverse();
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double squares = 0.0;
    for (const Sample& sample : samples_) {
      const Eigen::Vector2d row(see(back, sample).level.value, 1.0);
      normal += row * row.transpose();
      right += row * sample.grey;
      squares += sample.grey * sample.grey;
    }
    const Eigen::Vector2d light = normal.ldlt().solve(right);
    now_.gain = light.x();
    now_.level = light.y();
    const double rest = std::max(0.0, squares - right.dot(light));
    now_.noise = std::max(0.7, std::sqrt(rest / static_cast<double>(samples_.size())));
    return rest;
  }

  Step look() const {
    Step step;
    const Homography back = now_.homography.inverse();
    for (const Sample& sample : samples_) {
      const Seen seen = see(back, sample);
      const double residual = sample.grey - now_.gain * seen.level.value - now_.level;
      const double far = std::abs(residual) / (kHuber * now_.noise);
      const double weight = far <= 1.0 ? 1.0 : 1.0 / far;
      Row10 row;
      row.head<8>() = -now_.gain * (seen.level.slope.transpose() * seen.cells_by_place *
                                    by_homography(now_.homography, seen.q))
                                       .transpose();
      row[8] = seen.level.value;
      row[9] = 1.0;
      step.normal.noalias() += weight * row * row.transpose();
      step.gradient += weight * residual * row;
      step.sum_of_squares += weight * residual * residual;
      const double limit = kHuber * now_.noise;
      step.cost += far <= 1.0 ? residual * residual : limit * (2.0 * std::abs(residual) - limit);
    }
    return step;
  }

  void move(const Row10& step) {
    for (int i = 0; i < 8; ++i) now_.homography(i / 3, i % 3) += step[i];
    now_.gain += step[8];
    now_.level += step[9];
  }

  double largest_move(const Row10& step) const {
    double most = 0.0;
    for (const Eigen::Vector2d& corner : kUnitCorners)
      most = std::max(most, unit_ * (by_homography(now_.homography, corner) * step.head<8>()).norm());
    return most;
  }

  double correlation() const {
    const Homography back = now_.homography.inverse();
    double sum_a = 0.0, sum_b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    for (const Sample& sample : samples_) {
      const double a = see(back, sample).level.value;
      sum_a += a;
      sum_b += sample.grey;
      aa += a * a;
      bb += sample.grey * sample.grey;
      ab += a * sample.grey;
    }
    const double n = static_cast<double>(samples_.size());
    const double spread = (aa - sum_a * sum_a / n) * (bb - sum_b * sum_b / n);
    return spread > 0.0 ? (ab - sum_a * sum_b / n) / std::sqrt(spread) : 0.0;
  }

  const TagPattern& pattern_;
  double half_;  ///< cells between middle and corner along an axis
  TagCorners begun_;
  Pixel centre_{0.0, 0.0};
  double unit_ = 1e-9;  ///< px
  std::vector<Sample> samples_;
  State now_;
};

}  // namespace

namespace {

std::optional<TagFit> fit_at_scale(const cv::Mat& grey, const TagPattern& pattern,
                                   const TagCorners& corners_px) {
  Fit fit(grey, pattern, corners_px);
  if (!fit.enough()) return std::nullopt;
  fit.choose_blur();
  if (!fit.run()) return std::nullopt;
  // The blur was chosen where libapriltag saw the corners: it may be another one where they are.
  if (fit.choose_blur() && !fit.run()) return std::nullopt;
  return fit.result();
}

double longest_edge(const TagCorners& corners) {
  double longest = 0.0;
  for (std::size_t i = 0; i < 4; ++i) longest = std::max(longest, (corners[i] - corners[(i + 1) % 4]).norm());
  return longest;
}

/// Around the corners and the rim, cut to the picture, a multiple of `times` wide and high.
cv::Rect part_for(const cv::Mat& grey, const TagCorners& corners, int times) {
  Eigen::AlignedBox2d box;
  for (const Pixel& corner : corners) box.extend(corner);
  const Eigen::Vector2d rim = Eigen::Vector2d::Constant(0.5 * box.sizes().maxCoeff());
  const Eigen::Vector2d low = (box.min() - rim).cwiseMax(0.0);
  const Eigen::Vector2d high = (box.max() + rim).cwiseMin(Eigen::Vector2d(grey.cols - 1, grey.rows - 1));
  const auto length = [times](double from, double to) {
    return std::max(0, static_cast<int>(to - std::floor(from)) / times * times);
  };
  return {static_cast<int>(low.x()), static_cast<int>(low.y()), length(low.x(), high.x()),
          length(low.y(), high.y())};
}

}  // namespace

std::optional<TagFit> fit_tag(const cv::Mat& grey, const TagPattern& pattern, const TagCorners& corners_px) {
  // A large tag is made smaller first: all of its pixels tell then, at the cost of a few.
  const double whole_px = longest_edge(corners_px) * pattern.cells.cols / pattern.border_cells;
  const int times = static_cast<int>(std::min(1e3, std::ceil(whole_px / kLargest)));
  if (times <= 1) return fit_at_scale(grey, pattern, corners_px);
  const cv::Rect part = part_for(grey, corners_px, times);
  if (part.width < times || part.height < times) return std::nullopt;
  cv::Mat smaller;
  cv::resize(grey(part), smaller, cv::Size(part.width / times, part.height / times), 0, 0, cv::INTER_AREA);
  // The smaller picture's pixel (0, 0) has its middle between the first `times` pixels.
  const Pixel origin = Pixel(part.x, part.y) + Pixel::Constant(0.5 * (times - 1));
  TagCorners corners = corners_px;
  for (Pixel& corner : corners) corner = (corner - origin) / times;
  auto fit = fit_at_scale(smaller, pattern, corners);
  if (!fit) return fit;
  for (Pixel& corner : fit->corners_px) corner = times * corner + origin;
  fit->covariance *= times * times;
  return fit;
}

}  // namespace skylight
