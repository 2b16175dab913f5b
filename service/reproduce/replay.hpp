// Replays of observed runs through filters, and what came out against the truth.
//
// One definition of an error throughout: the distance on the floor between where a point of the robot is told
// to be and where that point truly is at the frame's capture time. Which point that is belongs to the variant
// (paper_frames.hpp): base_link for "vertical", as the paper judges 'before', base_scan for "ray", as it
// judges 'after', and base_link for every variant that is not the paper's.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "service/reproduce/observed_run.hpp"
#include "tracker/filter/filter.hpp"
#include "tracker/filter/window.hpp"

namespace skylight::service::reproduce {

using Runs = std::vector<ObservedRun>;
using FilterMaker = std::function<std::unique_ptr<Filter>()>;

/// A filter and what it is given.
struct Filtering {
  FilterMaker make;
  /// It filters the detected point itself, as the paper's does, and its estimates are of that point; else
  /// base_link.
  bool of_the_point = false;
};

/// Their names, in the order in which they first come.
std::vector<std::string> routes_of(const Runs& runs);

Filtering paper_filter(const WindowFilterConfig& config);

/// One frame, by the point that the variant is judged by: places in `map`, m.
struct TracedFrame {
  Time captured{};
  Eigen::Vector2d truth = Eigen::Vector2d::Zero();
  double truth_yaw = 0.0;
  std::optional<Eigen::Vector2d> detected;
  double detected_yaw = 0.0;
  std::optional<Eigen::Vector2d> estimated;  ///< none before the filter is calibrated, and while it is lost
};

/// Every frame of the run. Throws std::invalid_argument where the run has no such variant.
std::vector<TracedFrame> trace(const ObservedRun& run, std::string_view variant);  ///< without a filter
std::vector<TracedFrame> trace(const ObservedRun& run, std::string_view variant, const Filtering& filtering);

/// Errors of one run, m, frame by frame from the first that has one to the end of the route; where none has
/// one, all frames.
using Errors = std::vector<std::optional<double>>;

/// The paper's 'before': what was detected no further than `alpha_m` from the truth.
Errors accepted_errors(const ObservedRun& run, std::string_view variant, double alpha_m);
Errors filtered_errors(const ObservedRun& run, std::string_view variant, const Filtering& filtering);

/// Of one or more runs, each an experiment of the paper's.
struct ErrorFigures {
  std::size_t runs = 0;          ///< with an error at all
  std::size_t failed_runs = 0;   ///< without: never calibrated, nothing accepted
  std::size_t frames = 0;        ///< from the first with an error to the end of the route
  double mean_m = 0.0;           ///< of the runs' means
  double dispersion_m = 0.0;     ///< mean of the runs' standard deviations
  double minimum_m = 0.0;        ///< mean of the runs' smallest errors
  double spread_m = 0.0;         ///< standard deviation of the runs' means (divided by their number)
  double smallest_mean_m = 0.0;  ///< of the runs' means
  double largest_mean_m = 0.0;
  double pooled_mean_m = 0.0;  ///< over all frames of all runs
  double p95_m = 0.0;          ///< the same
  double p99_m = 0.0;
  double usable = 0.0;  ///< share of the frames with an error below 0.1 m
  double lost = 0.0;    ///< share of the frames without any
};

/// All 0 where there is nothing.
ErrorFigures figures_of(const std::vector<Errors>& runs);

}  // namespace skylight::service::reproduce
