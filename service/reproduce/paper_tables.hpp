// The paper's tables and figures from observed runs (paper_frames.hpp), and the same detections through
// another filter. Plain results; the report prints them beside the paper's own (paper_figures.hpp).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "service/reproduce/observed_run.hpp"
#include "service/reproduce/replay.hpp"

namespace skylight::service::reproduce {

/// Table 1: what is accepted by the distance from the truth, without a filter.
struct AcceptanceRow {
  std::string configuration;
  std::string variant;
  double alpha_m = 0.0;
  std::size_t frames = 0;
  std::size_t found = 0;
  std::size_t accepted = 0;
  double mean_m = 0.0;  ///< over the accepted ones, pooled

  double of_all() const;    ///< share accepted of all frames; 0 of none
  double of_found() const;  ///< of those in which the robot was found
};
std::vector<AcceptanceRow> table_1(const Runs& runs);

/// Figs. 6 and 7: the window filter on one variant, one setting after the other.
struct SweepPoint {
  double value = 0.0;  ///< the window's size, or alpha in m
  ErrorFigures figures;
};
std::vector<SweepPoint> figure_6(const Runs& runs, std::string_view variant = "ray");
std::vector<SweepPoint> figure_7(const Runs& runs, std::string_view variant = "ray");
/// The one with the smallest mean error; `points` must not be empty.
const SweepPoint& best(const std::vector<SweepPoint>& points);

/// Table 2. Before: "vertical", what is within 0.25 m of the truth, no filter. After: "ray" through the
/// window filter of 12 and 0.3 m.
struct MovementRow {
  std::string movement;  ///< linear, curvilinear, average; of a route its name
  ErrorFigures before;
  ErrorFigures after;

  double improvement() const;  ///< mean before over mean after; 0 where one is missing
};
struct Table2 {
  std::vector<MovementRow> movements;  ///< linear, curvilinear; average: the mean of the two, as in the paper
  std::vector<MovementRow> routes;     ///< in the order in which they first come
};
Table2 table_2(const Runs& runs);

/// Two filters on the same detections, over the frames from where both are calibrated (or the one that ever
/// is), and of them those for which both have an estimate.
struct ContestRow {
  std::string route;          ///< or "curvilinear", "linear": the frames of all those pooled
  std::size_t frames = 0;     ///< from where both are calibrated
  std::size_t both = 0;       ///< with an estimate of each
  double first_mean_m = 0.0;  ///< over those
  double second_mean_m = 0.0;
  double first_p99_m = 0.0;
  double second_p99_m = 0.0;
  double first_lost = 0.0;  ///< share of the frames without an estimate
  double second_lost = 0.0;

  double ratio() const;  ///< first mean over second: above 1 the second is better; 0 where there is none
};
/// Route by route, then linear and curvilinear.
std::vector<ContestRow> contest(const Runs& runs, std::string_view variant, const Filtering& first,
                                const Filtering& second);

}  // namespace skylight::service::reproduce
