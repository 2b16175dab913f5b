#include "tracker/detect/align.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include "tracker/detect/local_projection.hpp"

namespace skylight {
namespace {

using Eigen::ArrayXf;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinVisible = 0.6;  // share of the samples that must lie in the frame
constexpr double kMinGain = 0.2;     // of the frame against the picture; less is a flat floor
constexpr double kMaxGain = 5.0;
constexpr double kMinNoise = 0.5;            // grey levels: quantisation alone leaves 0.3
constexpr double kMaxPositionSigmaPx = 0.5;  // beyond this the evidence is called thin
constexpr double kMaxYawSigma = 0.1;         // rad
constexpr double kModelErrorPx = 0.01;  // bias that stays however little the noise: see tracker/README.md
constexpr double kMaxStepPx = 3.0;      // the picture is not linear further out
constexpr double kSettlePx = 0.15;      // a step below this: near enough to tell what covers the robot
constexpr int kMinSettled = 2;          // of them at least: each sees more clearly what covers the robot
constexpr int kMaxApproach = 10;        // iterations until what disagrees is left out in any case

// A part of the frame as smoothed float planes.
struct Region {
  cv::Point origin;
  std::vector<cv::Mat> planes;
};

std::optional<Region> cut_region(const cv::Mat& image, const Vector2d& centre_px, double radius_px,
                                 double blur_px, int channels) {
  const int r = static_cast<int>(std::ceil(radius_px)) + 2;
  const cv::Point middle(static_cast<int>(std::lround(centre_px.x())),
                         static_cast<int>(std::lround(centre_px.y())));
  const cv::Rect roi =
      cv::Rect(middle.x - r, middle.y - r, 2 * r + 1, 2 * r + 1) & cv::Rect({}, image.size());
  if (roi.width < 4 || roi.height < 4) return std::nullopt;
  cv::Mat part = image(roi);
  if (channels == 1 && part.channels() == 3) cv::cvtColor(part, part, cv::COLOR_BGR2GRAY);
  cv::Mat values;
  part.convertTo(values, CV_32F);
  if (blur_px > 0.0) {
    const int size = 2 * static_cast<int>(std::ceil(3.0 * blur_px)) + 1;
    // Beyond the region there are pixels of the frame, but none that a sample needs: the reach is padded.
    cv::GaussianBlur(values, values, {size, size}, blur_px, blur_px, cv::BORDER_REPLICATE);
  }
  Region region{.origin = roi.tl(), .planes = {}};
  cv::split(values, region.planes);
  return region;
}

// The unknown pose while it is iterated: the picture's centre on the floor, and yaw.
struct Iterate {
  Vector2d centre_m;
  double yaw = 0.0;
};

// What one look at the frame from the current pose gives.
struct Reading {
  std::vector<ArrayXf> values;  // per channel
  ArrayXf visible;              // 1 in the frame, 0 outside
};

// Places of the samples in the frame: the quadratic of the camera composed with the robot's turn, so that
// each sample costs ten multiplications.
void read_frame(const Patch& patch, const Region& region, const LocalProjection& local, const Iterate& at,
                Reading& out) {
  const Vector2d offset = at.centre_m - local.centre_m;
  const double c = std::cos(at.yaw);
  const double s = std::sin(at.yaw);
  const Vector2d ex(c, s);
  const Vector2d ey(-s, c);
  const auto cross = [&](const Vector2d& a, const Vector2d& b) -> Vector2d {
    return 2 * a.x() * b.x() * local.xx + (a.x() * b.y() + a.y() * b.x()) * local.xy +
           2 * a.y() * b.y() * local.yy;
  };
  const Vector2d origin(region.origin.x, region.origin.y);
  const Eigen::Vector2f p0 = (local.pixel(offset) - origin).cast<float>();
  const Eigen::Vector2f px = (local.jacobian * ex + cross(offset, ex)).cast<float>();
  const Eigen::Vector2f py = (local.jacobian * ey + cross(offset, ey)).cast<float>();
  const Eigen::Vector2f pxx = (0.5 * cross(ex, ex)).cast<float>();
  const Eigen::Vector2f pxy = cross(ex, ey).cast<float>();
  const Eigen::Vector2f pyy = (0.5 * cross(ey, ey)).cast<float>();
  const ArrayXf& x = patch.x;
  const ArrayXf& y = patch.y;
  const ArrayXf u = p0.x() + x * (px.x() + x * pxx.x() + y * pxy.x()) + y * (py.x() + y * pyy.x());
  const ArrayXf v = p0.y() + x * (px.y() + x * pxx.y() + y * pxy.y()) + y * (py.y() + y * pyy.y());

  const auto max_u = static_cast<float>(region.planes[0].cols - 1);
  const auto max_v = static_cast<float>(region.planes[0].rows - 1);
  const std::size_t stride = region.planes[0].step1();
  out.visible.resize(patch.size());
  out.values.resize(region.planes.size());
  for (ArrayXf& values : out.values) values.resize(patch.size());
  for (Eigen::Index i = 0; i < patch.size(); ++i) {
    const bool in = u[i] >= 0 && v[i] >= 0 && u[i] < max_u && v[i] < max_v;
    out.visible[i] = in ? 1.0F : 0.0F;
    const auto iu = in ? static_cast<std::size_t>(u[i]) : 0;
    const auto iv = in ? static_cast<std::size_t>(v[i]) : 0;
    const float fu = in ? u[i] - static_cast<float>(iu) : 0.0F;
    const float fv = in ? v[i] - static_cast<float>(iv) : 0.0F;
    for (std::size_t channel = 0; channel < region.planes.size(); ++channel) {
      const float* p = region.planes[channel].ptr<float>() + iv * stride + iu;
      const float top = p[0] + fu * (p[1] - p[0]);
      const float bottom = p[stride] + fu * (p[stride + 1] - p[stride]);
      out.values[channel][i] = top + fv * (bottom - top);
    }
  }
}

// Light per channel: frame = gain * (picture - mean) + level.
struct Light {
  double gain = 0.0;
  double level = 0.0;
};

using Terms = Eigen::Matrix<double, 5, 5>;
using Rhs = Eigen::Matrix<double, 5, 1>;

struct Normal {
  std::vector<Terms> terms;  // per channel: weighted products of the patch's five columns
  std::vector<Rhs> rhs;      // their products with the frame's values
};

Normal accumulate(const Patch& patch, const Reading& reading, const ArrayXf& weight) {
  Normal normal;
  for (std::size_t c = 0; c < patch.channels.size(); ++c) {
    const auto& terms = patch.channels[c].terms;
    const Eigen::Matrix<float, Eigen::Dynamic, 5> weighted = terms.array().colwise() * weight;
    normal.terms.emplace_back((terms.transpose() * weighted).cast<double>());
    normal.rhs.emplace_back((weighted.transpose() * reading.values[c].matrix()).cast<double>());
  }
  return normal;
}

// The best light for the pose as it is. None where a channel that carries contrast has no plausible gain:
// then the frame does not show this picture here. A flat channel takes whatever gain, it does not matter.
bool fit_light(const Patch& patch, const Normal& normal, std::vector<Light>& light) {
  double best_contrast = 0.0;
  for (const auto& channel : patch.channels) best_contrast = std::max(best_contrast, channel.contrast);
  light.resize(patch.channels.size());
  for (std::size_t c = 0; c < light.size(); ++c) {
    const Eigen::Matrix2d a = normal.terms[c].bottomRightCorner<2, 2>();
    const Eigen::Vector2d solution = a.ldlt().solve(normal.rhs[c].tail<2>());
    if (!solution.allFinite()) return false;
    light[c] = {solution[0], solution[1]};
    const bool matters = patch.channels[c].contrast > 0.5 * best_contrast;
    if (matters && !(light[c].gain > kMinGain && light[c].gain < kMaxGain)) return false;
    light[c].gain = std::clamp(light[c].gain, 0.0, kMaxGain);
  }
  return true;
}

struct PoseSystem {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // light eliminated; per px^2, noise variance 1
  Vector3d gradient = Vector3d::Zero();
};

// Gauss-Newton normal equations for the movement alone: gain and level are eliminated by their Schur
// complement, channel by channel.
PoseSystem eliminate_light(const Normal& normal, const std::vector<Light>& light) {
  PoseSystem system;
  for (std::size_t c = 0; c < light.size(); ++c) {
    const double g = light[c].gain;
    const Eigen::Matrix3d pp = g * g * normal.terms[c].topLeftCorner<3, 3>();
    const Eigen::Matrix<double, 3, 2> pl = g * normal.terms[c].topRightCorner<3, 2>();
    const Eigen::Matrix2d ll = normal.terms[c].bottomRightCorner<2, 2>();
    const Eigen::Matrix<double, 2, 3> solved = ll.ldlt().solve(pl.transpose());
    system.information += pp - pl * solved;
    system.gradient += g * normal.rhs[c].head<3>() - solved.transpose() * normal.rhs[c].tail<2>();
  }
  return system;
}

ArrayXf residual_size(const Patch& patch, const Reading& reading, const std::vector<Light>& light) {
  ArrayXf squares = ArrayXf::Zero(patch.size());
  for (std::size_t c = 0; c < light.size(); ++c) {
    squares += (reading.values[c] - static_cast<float>(light[c].level) -
                static_cast<float>(light[c].gain) * patch.channels[c].terms.col(3).array())
                   .square();
  }
  return (squares / static_cast<float>(light.size())).sqrt();
}

double median_of(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Noise of what agrees: from the median, which half the picture may leave.
double noise_of(const ArrayXf& residual, const ArrayXf& visible) {
  std::vector<float> seen;
  for (Eigen::Index i = 0; i < residual.size(); i += 5) {
    if (visible[i] > 0) seen.push_back(residual[i]);
  }
  return seen.empty() ? kMinNoise : std::max(kMinNoise, 1.4826 * median_of(std::move(seen)));
}

double picture_contrast(const Patch& patch, const std::vector<Light>& light) {
  double squares = 0.0;
  for (std::size_t c = 0; c < light.size(); ++c)
    squares += std::pow(light[c].gain * patch.channels[c].contrast, 2);
  return std::sqrt(squares / static_cast<double>(light.size()));
}

enum class Stage { approach, settle, settle_smeared };

// Far from the answer every edge disagrees, so that nothing may be thrown away (Huber); once there, what
// still disagrees is no part of the picture (Tukey). A picture smeared by a quick turn disagrees at every
// edge: there only the noise says what is too much.
ArrayXf robust_weight(const ArrayXf& residual, const ArrayXf& visible, double noise, double contrast,
                      Stage stage) {
  if (stage == Stage::approach) {
    const auto bound = static_cast<float>(std::max(3.0 * noise, 0.3 * contrast));
    return visible * (residual <= bound).select(ArrayXf::Ones(residual.size()), bound / residual.max(bound));
  }
  // Else bounded by the picture's own contrast: where much is covered, the noise is overrated at first.
  const double bound_grey = stage == Stage::settle_smeared
                                ? std::max(6.0 * noise, 0.6 * contrast)
                                : std::clamp(4.0 * noise, 0.35 * contrast, 0.8 * contrast);
  const auto bound = static_cast<float>(bound_grey);
  return visible * (1.0F - (residual / bound).square()).max(0.0F).square();
}

// Sum of the noise's autocorrelation after smoothing and bilinear reading: 1 / sum(kernel^2), with the
// kernel as a Gaussian of the same variance (bilinear: 1/6 px^2 on average).
double correlated_samples(const PatchScale& scale, double spacing_m) {
  const double variance = scale.blur_px * scale.blur_px + 1.0 / 6.0;
  const double spacing_px = spacing_m / scale.metres_per_px;
  return std::max(1.0, 4.0 * std::numbers::pi * variance / (spacing_px * spacing_px));
}

struct LevelResult {
  Iterate at;
  PoseSystem system;
  double score = 0.0;
  double agreeing = 0.0;
  double correlation = 0.0;
  double sigma = 0.0;
  int iterations = 0;
};

// The score's own idea of what agrees is wider than the weights': a picture smeared by a quick turn agrees,
// badly, everywhere, and that is another thing than one that is covered in part.
void judge(const Patch& patch, const Reading& reading, const std::vector<Light>& light, LevelResult& result) {
  const ArrayXf residual = residual_size(patch, reading, light);
  const double bound =
      std::max(4.5 * noise_of(residual, reading.visible), 0.45 * picture_contrast(patch, light));
  const ArrayXf inlier = reading.visible * (residual < static_cast<float>(bound)).cast<float>();
  const double count = inlier.sum();
  result.agreeing = count / static_cast<double>(patch.size());
  if (count < 16) return;
  double tt = 0.0;
  double tf = 0.0;
  double ff = 0.0;
  double squares = 0.0;
  for (std::size_t c = 0; c < light.size(); ++c) {
    const ArrayXf& f = reading.values[c];
    const ArrayXf t = patch.channels[c].terms.col(3).array();
    const double mean_f = (inlier * f).sum() / count;
    const double mean_t = (inlier * t).sum() / count;
    const ArrayXf df = inlier * (f - static_cast<float>(mean_f));
    const ArrayXf dt = inlier * (t - static_cast<float>(mean_t));
    const double g = light[c].gain;
    tt += g * g * (dt * dt).sum();
    tf += g * (dt * df).sum();
    ff += (df * df).sum();
    squares += (inlier * (f - static_cast<float>(light[c].level) - static_cast<float>(g) * t).square()).sum();
  }
  result.correlation = tt > 0 && ff > 0 ? std::max(0.0, tf / std::sqrt(tt * ff)) : 0.0;
  result.sigma = std::sqrt(squares / (count * static_cast<double>(light.size())));
  result.score = std::clamp(result.agreeing * result.correlation, 0.0, 1.0);
}

// One Gauss-Newton step from the reading at the present pose, in pixels: forward, left, around.
std::optional<Vector3d> solve_step(const PoseSystem& system) {
  const Eigen::LDLT<Eigen::Matrix3d> solver(system.information);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
  const Vector3d step = solver.solve(system.gradient);
  if (!step.allFinite()) return std::nullopt;
  return step * std::min(1.0, kMaxStepPx / step.norm());
}

std::optional<LevelResult> align_level(const Patch& patch, const Region& region, const LocalProjection& local,
                                       Iterate at, const AlignConfig& config, bool smeared) {
  LevelResult result;
  const Stage settle = smeared ? Stage::settle_smeared : Stage::settle;
  Reading reading;
  std::vector<Light> light;
  ArrayXf weight = ArrayXf::Ones(patch.size());
  const Vector2d start = at.centre_m;
  int settled = 0;  // iterations since the approach
  while (result.iterations++ < config.max_iterations) {
    read_frame(patch, region, local, at, reading);
    if (reading.visible.mean() < kMinVisible) return std::nullopt;
    weight *= reading.visible;
    const Normal normal = accumulate(patch, reading, weight);
    if (!fit_light(patch, normal, light)) return std::nullopt;
    result.system = eliminate_light(normal, light);
    const auto step = solve_step(result.system);
    if (!step) return std::nullopt;
    // The weights of the next step, from what this pose leaves over.
    const ArrayXf residual = residual_size(patch, reading, light);
    weight = robust_weight(residual, reading.visible, noise_of(residual, reading.visible),
                           picture_contrast(patch, light), settled > 0 ? settle : Stage::approach);
    // The frame shows the picture's content displaced by `step`: the pose moves against it.
    at.yaw -= (*step)[2] / patch.radius_px();
    at.centre_m -= Eigen::Rotation2Dd(at.yaw) * step->head<2>() * patch.scale.metres_per_px;
    if ((at.centre_m - start).norm() > patch.radius_m) return std::nullopt;
    if (settled >= kMinSettled && step->norm() < config.converged_px) break;
    if (settled > 0 || step->norm() < kSettlePx || result.iterations >= kMaxApproach) ++settled;
  }
  result.at = at;
  judge(patch, reading, light, result);
  return result;
}

// Covariance of base_link from that of the picture's centre in robot axes.
Covariance3 base_link_covariance(const Eigen::Matrix3d& covariance_px, const Patch& patch,
                                 const Appearance& appearance, double yaw) {
  const double px = patch.scale.metres_per_px;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(yaw).toRotationMatrix();
  Eigen::Matrix3d by_step = Eigen::Matrix3d::Zero();
  by_step.topLeftCorner<2, 2>() = -px * turn;
  by_step(2, 2) = -1.0 / patch.radius_px();
  const Vector2d c = turn * appearance.centre_m();
  // base_link = centre - R(yaw) c, so it moves by (c.y, -c.x) per radian of yaw.
  by_step(0, 2) = c.y() * by_step(2, 2);
  by_step(1, 2) = -c.x() * by_step(2, 2);
  return by_step * covariance_px * by_step.transpose();
}

}  // namespace

Aligner::Aligner(std::shared_ptr<const Appearance> appearance, const AlignConfig& config)
    : appearance_(std::move(appearance)), config_(config) {}

const Patch& Aligner::patch_for(const PatchScale& scale) {
  // The samples are metric: scales that share a patch differ in nothing but a blur 2 % too wide or narrow.
  constexpr double kSameScale = 0.02;
  for (const Patch& patch : patches_) {
    if (patch.scale.blur_px == scale.blur_px && patch.scale.channels == scale.channels &&
        std::abs(patch.scale.metres_per_px / scale.metres_per_px - 1.0) < kSameScale) {
      return patch;
    }
  }
  constexpr std::size_t kMaxPatches = 64;
  if (patches_.size() >= kMaxPatches) patches_.erase(patches_.begin());
  patches_.push_back(make_patch(*appearance_, scale));
  return patches_.back();
}

std::optional<AlignResult> Aligner::align(const Frame& frame, const CameraModel& camera,
                                          const Placement& prior, AlignMode mode) {
  const Eigen::Vector2d size = appearance_->size_m();
  Iterate at{.centre_m = prior.pose.position() + Eigen::Rotation2Dd(prior.pose.yaw) * appearance_->centre_m(),
             .yaw = prior.pose.yaw};
  const auto local = LocalProjection::at(camera, at.centre_m, prior.surface_height_m, 0.5 * size.norm());
  if (!local) return std::nullopt;

  const int channels = appearance_->coloured() && frame.image.channels() == 3 ? 3 : 1;
  std::optional<LevelResult> result;
  const Patch* patch = nullptr;
  for (const double blur : {config_.coarse_blur_px, config_.blur_px}) {
    const bool coarse = blur == config_.coarse_blur_px;
    if (coarse && mode != AlignMode::coarse) continue;
    patch = &patch_for({.metres_per_px = local->metres_per_px(), .blur_px = blur, .channels = channels});
    if (patch->size() < 32) {
      if (coarse) continue;
      return std::nullopt;
    }
    // Samples may walk by what the mode is for; beyond, they count as not seen.
    const double walk_px = mode == AlignMode::coarse ? 0.5 * patch->radius_px() + 4.0 : 4.0;
    const double reach_px = patch->radius_px() + walk_px + 3.0 * blur;
    const auto region =
        cut_region(frame.image, local->pixel(at.centre_m - local->centre_m), reach_px, blur, channels);
    if (!region) return std::nullopt;
    result = align_level(*patch, *region, *local, at, config_, mode != AlignMode::fine);
    if (!result) return std::nullopt;
    at = result->at;
  }

  const double noise = std::max(result->sigma, kMinNoise);
  Eigen::Matrix3d covariance_px = noise * noise * correlated_samples(patch->scale, patch->spacing_m) *
                                  result->system.information.inverse();
  covariance_px.diagonal().array() += kModelErrorPx * kModelErrorPx;
  AlignResult out{.score = result->score,
                  .agreeing = result->agreeing,
                  .correlation = result->correlation,
                  .residual_sigma = result->sigma,
                  .iterations = result->iterations};
  out.pose.yaw = wrap_angle(at.yaw);
  const Vector2d base = at.centre_m - Eigen::Rotation2Dd(at.yaw) * appearance_->centre_m();
  out.pose.x = base.x();
  out.pose.y = base.y();
  out.covariance = base_link_covariance(covariance_px, *patch, *appearance_, at.yaw);
  const double position_sigma_px = std::sqrt(covariance_px.topLeftCorner<2, 2>().trace());
  const double yaw_sigma = std::sqrt(out.covariance(2, 2));
  if (!(position_sigma_px < kMaxPositionSigmaPx) || !(yaw_sigma < kMaxYawSigma)) return std::nullopt;
  return out;
}

}  // namespace skylight
