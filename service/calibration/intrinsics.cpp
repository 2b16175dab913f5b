#include "service/calibration/intrinsics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "service/calibration/lens_fit.hpp"
#include "service/calibration/median.hpp"
#include "service/calibration/text.hpp"

namespace skylight::calibration {
namespace {

constexpr std::size_t kFewestViews = 3;
constexpr std::size_t kFewestCorners = 6;
/// A view whose error is this many times the middle one's is no view of this board and lens.
constexpr double kBadView = 3.0;
/// Corners further off than this many standard deviations are left out; of a view at most this share.
constexpr double kBadCorner = 5.0;
constexpr double kMostLeftOut = 0.2;
/// Errors below are never called bad, px.
constexpr double kGoodEnough = 0.5;
/// Loss beyond which a corner is taken less seriously until bad ones are found, px.
constexpr double kRobust = 1.0;
constexpr int kMostRounds = 6;
/// The simpler pinhole is kept unless the fisheye is better by this share.
constexpr double kClearlyBetter = 0.05;
/// Standard deviation of the focal length, as a share: beyond, there is no calibration, and a warning.
constexpr double kUnknownFocal = 0.1;
constexpr double kPoorFocal = 0.005;
/// Reprojection error of a board that is not as described, px.
constexpr double kContradiction = 3.0;

/// A fit and which views and corners it goes by.
struct Candidate {
  LensFit fit;
  FitOptions options;
  std::vector<std::string> why_not;  ///< by view; empty: used
  std::vector<double> view_rms;
  double rms_px = 0.0;
  std::size_t corners = 0;
  double robust_cost = 0.0;  ///< over all views, to compare lenses by
};

FitOptions all_corners(const std::vector<BoardView>& views) {
  FitOptions options;
  for (const BoardView& view : views) options.used.emplace_back(view.points.size(), true);
  return options;
}

double rms(const std::vector<double>& errors, const std::vector<bool>& used) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!used[i]) continue;
    sum += errors[i] * errors[i];
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

/// Leaves out what does not agree with the rest. True where something changed.
bool leave_out(const std::vector<BoardView>& views, Candidate& candidate) {
  const auto errors = reprojection_errors(views, candidate.fit);
  std::vector<double> all;
  std::vector<double> by_view;
  for (std::size_t view = 0; view < views.size(); ++view) {
    if (!candidate.why_not[view].empty()) continue;
    all.insert(all.end(), errors[view].begin(), errors[view].end());
    by_view.push_back(rms(errors[view], std::vector<bool>(errors[view].size(), true)));
  }
  // Half of the distances of a Gaussian in the plane are below 1.1774 sigma.
  const double corner_limit = std::max(kGoodEnough, kBadCorner * median(all) / 1.1774);
  const double view_limit = std::max(kGoodEnough, kBadView * median(by_view));
  bool changed = false;
  for (std::size_t view = 0; view < views.size(); ++view) {
    if (!candidate.why_not[view].empty()) continue;
    std::vector<bool> good(errors[view].size());
    std::transform(errors[view].begin(), errors[view].end(), good.begin(),
                   [&](double error) { return error <= corner_limit; });
    const auto bad = std::count(good.begin(), good.end(), false);
    if (static_cast<double>(bad) > kMostLeftOut * static_cast<double>(good.size()) ||
        rms(errors[view], good) > view_limit) {
      candidate.why_not[view] = "reprojection error " +
                                fixed(rms(errors[view], std::vector<bool>(good.size(), true)), 2) +
                                " px where the other views have " + fixed(median(by_view), 2) +
                                " px: blurred, a board that moved or bent, or corners mistaken for others";
      good.assign(good.size(), false);
      changed = true;
    } else if (good != candidate.options.used[view]) {
      changed = true;
    }
    candidate.options.used[view] = good;
  }
  return changed;
}

void sum_up(const std::vector<BoardView>& views, Candidate& candidate) {
  const auto errors = reprojection_errors(views, candidate.fit);
  double sum = 0.0;
  candidate.corners = 0;
  candidate.view_rms.clear();
  for (std::size_t view = 0; view < views.size(); ++view) {
    const auto& used = candidate.options.used[view];
    const bool dropped = !candidate.why_not[view].empty();
    candidate.view_rms.push_back(rms(errors[view], dropped ? std::vector<bool>(used.size(), true) : used));
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      sum += errors[view][i] * errors[view][i];
      ++candidate.corners;
    }
  }
  candidate.rms_px = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, candidate.corners)));
}

/// The whole picture has rays: the lens's model does not fold back within it.
bool holds_in_picture(const Intrinsics& in) {
  const CameraModel camera(in, Eigen::Isometry3d::Identity());
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (in.width_px - 1.0) * i / kSteps;
    const double y = (in.height_px - 1.0) * i / kSteps;
    if (!camera.ray_from_pixel({x, 0.0}) || !camera.ray_from_pixel({x, in.height_px - 1.0}) ||
        !camera.ray_from_pixel({0.0, y}) || !camera.ray_from_pixel({in.width_px - 1.0, y}))
      return false;
  }
  return true;
}

/// A pinhole's polynomial that folds back where no corner held it: one with fewer terms, if that fits as
/// well.
void keep_from_folding(const std::vector<BoardView>& views, Candidate& candidate) {
  if (candidate.fit.intrinsics.lens != LensModel::brown_conrady) return;
  for (const bool hold_k2 : {false, true}) {
    if (holds_in_picture(candidate.fit.intrinsics)) return;
    Candidate simpler = candidate;
    simpler.options.hold_k3 = true;
    simpler.options.hold_k2 = hold_k2;
    if (!improve(views, simpler.options, simpler.fit)) continue;
    sum_up(views, simpler);
    if (simpler.rms_px <= (1.0 + kClearlyBetter) * candidate.rms_px) candidate = simpler;
  }
}

std::optional<Candidate> fit_lens(const std::vector<BoardView>& views, const IntrinsicsOptions& options,
                                  LensModel lens) {
  Candidate candidate{.options = all_corners(views), .why_not = std::vector<std::string>(views.size())};
  const auto first = first_fit(views, options, lens, candidate.options);
  if (!first) return std::nullopt;
  candidate.fit = *first;
  candidate.options.robust_px = kRobust;
  if (!improve(views, candidate.options, candidate.fit)) return std::nullopt;
  candidate.robust_cost = candidate.fit.cost;
  for (int round = 0; round < kMostRounds && leave_out(views, candidate); ++round) {
    if (!improve(views, candidate.options, candidate.fit)) return std::nullopt;
  }
  candidate.options.robust_px = 0.0;
  if (!improve(views, candidate.options, candidate.fit)) return std::nullopt;
  sum_up(views, candidate);
  keep_from_folding(views, candidate);
  return candidate;
}

Candidate choose_lens(const std::vector<BoardView>& views, const IntrinsicsOptions& options,
                      std::string& reason) {
  const auto wanted = [&](LensModel lens) { return !options.lens || *options.lens == lens; };
  std::optional<Candidate> pinhole;
  std::optional<Candidate> fisheye;
  if (wanted(LensModel::brown_conrady)) pinhole = fit_lens(views, options, LensModel::brown_conrady);
  if (wanted(LensModel::kannala_brandt)) fisheye = fit_lens(views, options, LensModel::kannala_brandt);
  if (!pinhole && !fisheye)
    throw std::invalid_argument("the views fit no lens: is the board described as it is, and flat?");
  if (!pinhole || !fisheye) {
    if (!options.lens) reason = pinhole ? "no fisheye fits at all" : "no pinhole fits at all";
    return pinhole ? *pinhole : *fisheye;
  }
  const bool takes_fisheye = fisheye->robust_cost < (1.0 - kClearlyBetter) * pinhole->robust_cost;
  reason = "reprojection error " + fixed(pinhole->rms_px, 3) + " px as a pinhole, " +
           fixed(fisheye->rms_px, 3) + " px as a fisheye" +
           (takes_fisheye ? "" : "; the pinhole is taken unless the other is clearly better");
  return takes_fisheye ? *fisheye : *pinhole;
}

void check_views(const std::vector<BoardView>& views) {
  if (views.size() < kFewestViews)
    throw std::invalid_argument("the board was found in " + std::to_string(views.size()) +
                                " pictures, at least " + std::to_string(kFewestViews) +
                                " are needed, 10 to 20 are good");
  for (const BoardView& view : views) {
    if (view.points.size() != view.pixels.size() || view.points.size() < kFewestCorners)
      throw std::invalid_argument(view.name + ": at least " + std::to_string(kFewestCorners) +
                                  " corners are needed, as many places as pixels");
  }
}

void report_views(const std::vector<BoardView>& views, const Candidate& candidate, IntrinsicsResult& result) {
  const Intrinsics& in = result.intrinsics;
  for (std::size_t view = 0; view < views.size(); ++view) {
    const Eigen::Matrix3d& rotation = candidate.fit.camera_from_board[view].linear();
    const auto& used = candidate.options.used[view];
    const bool is_used = candidate.why_not[view].empty();
    result.views.push_back(
        {.name = views[view].name,
         .used = is_used,
         .why_not = candidate.why_not[view],
         .rms_px = candidate.view_rms[view],
         .points = static_cast<int>(used.size()),
         .points_left_out = is_used ? static_cast<int>(std::count(used.begin(), used.end(), false)) : 0,
         .tilt_rad = std::acos(std::clamp(-rotation(2, 2), -1.0, 1.0))});
    if (is_used)
      add_view(result.coverage, views[view].pixels, rotation.col(2),
               Eigen::Vector2d(in.width_px, in.height_px));
  }
}

void judge(IntrinsicsResult& result) {
  const Intrinsics& in = result.intrinsics;
  const double focal = std::sqrt(result.covariance(kFocalX, kFocalX)) / in.fx_px;
  if (!(focal < kUnknownFocal))
    throw std::invalid_argument("the views leave the focal length open (known to " + fixed(100.0 * focal, 0) +
                                " % only): hold the board tilted by 15 to 45 degrees to several sides");
  if (focal > kPoorFocal)
    result.warnings.push_back("the focal length is known to " + fixed(100.0 * focal, 1) +
                              " % only: more views, tilted, near and far");
  if (in.lens == LensModel::brown_conrady && !holds_in_picture(in))
    result.warnings.emplace_back(
        "in the corners of the picture the lens's model does not hold: show the board there, or try the "
        "fisheye");
  for (std::string& missing : missing_views(result.coverage)) result.warnings.push_back(std::move(missing));
}

}  // namespace

IntrinsicsResult calibrate_intrinsics(const std::vector<BoardView>& views, const IntrinsicsOptions& options) {
  check_views(views);
  IntrinsicsResult result;
  const Candidate candidate = choose_lens(views, options, result.lens_reason);
  result.intrinsics = candidate.fit.intrinsics;
  result.rms_px = candidate.rms_px;
  report_views(views, candidate, result);
  if (result.rms_px > kContradiction)
    throw std::invalid_argument(
        "the views do not agree with each other (reprojection error " + fixed(result.rms_px, 1) +
        " px): is the board flat and described as it is, does the lens keep its focus "
        "and zoom?");
  const auto used = static_cast<std::size_t>(std::count_if(result.views.begin(), result.views.end(),
                                                           [](const ViewResult& view) { return view.used; }));
  if (used < kFewestViews)
    throw std::invalid_argument(
        "only " + std::to_string(used) + " of " + std::to_string(views.size()) +
        " views agree with each other: is the board flat and described as it is, does "
        "the lens keep its focus and zoom?");
  const auto unit = unit_covariance(views, candidate.options, candidate.fit);
  if (!unit)
    throw std::invalid_argument(
        "the views do not determine the lens: hold the board tilted by 15 to 45 degrees to several sides, "
        "and in "
        "all parts of the picture");
  const double unknowns = kCameraPosition + 6.0 * static_cast<double>(used);
  const double surplus = std::max(1.0, 2.0 * static_cast<double>(candidate.corners) - unknowns);
  const double variance =
      candidate.rms_px * candidate.rms_px * static_cast<double>(candidate.corners) / surplus;
  result.covariance = variance * *unit;
  judge(result);
  return result;
}

}  // namespace skylight::calibration
