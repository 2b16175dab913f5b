#include "sample.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "service/report/shares.hpp"

namespace skylight::service::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

double spread(std::uint64_t n) {
  return noise(3 * n) + noise(3 * n + 1) + noise(3 * n + 2) - 1.5;
}

Plot trajectory(const std::string& id, double turn, std::uint64_t seed) {
  Series seen{.name = "detections", .style = Style::dots, .colour = Colour::grey};
  Series line{.name = "our line", .style = Style::line, .colour = Colour::vermillion};
  Series truth{.name = "truth", .style = Style::dashed, .colour = Colour::ink};
  double heading = 0.3;
  double x = -2.0;
  double y = -1.2;
  for (std::uint64_t i = 0; i < 240; ++i) {
    heading += turn * std::sin(0.05 * static_cast<double>(i)) + 0.01;
    x += 0.02 * std::cos(heading);
    y += 0.02 * std::sin(heading);
    truth.x.push_back(x);
    truth.y.push_back(y);
    line.x.push_back(x + 0.02 * spread(seed + i));
    line.y.push_back(y + 0.02 * spread(seed + 7000 + i));
    if (i % 3 != 0) continue;
    seen.x.push_back(x + 0.12 * spread(seed + 300 + i));
    seen.y.push_back(y + 0.12 * spread(seed + 900 + i));
  }
  return {.id = id,
          .title = "Trajectory of " + id,
          .x_label = "x (m)",
          .y_label = "y (m)",
          .series = {seen, line, truth},
          .equal_axes = true};
}

// As the paper's Figs. 6 and 7: an error over a parameter, with the spread of ten runs.
Plot sweep() {
  Series ours{.name = "ours, mean of 10 runs with its least and largest", .style = Style::line_and_dots};
  Series paper{.name = "the paper's Fig. 6", .style = Style::line_and_dots, .colour = Colour::grey};
  for (int window = 5; window <= 24; ++window) {
    const double w = window;
    const double mean =
        0.05 + 0.0004 * (w - 12) * (w - 12) + 0.004 * noise(static_cast<std::uint64_t>(window));
    ours.x.push_back(w);
    ours.y.push_back(mean);
    ours.low.push_back(0.86 * mean);
    ours.high.push_back(1.21 * mean);
    paper.x.push_back(w);
    paper.y.push_back(0.058 + 0.0005 * (w - 12) * (w - 12));
  }
  return {.id = "fig-6",
          .title = "Error over the size of the window",
          .x_label = "window size (detections)",
          .y_label = "mean error (m)",
          .series = {ours, paper},
          .y_range = {.low = 0.0},
          .vertical = {{12.0, "the paper's choice"}},
          .caption = "alpha is 0.25 m. Both have their minimum inside."};
}

Plot error_along_time() {
  Series filtered{.name = "filtered", .style = Style::line};
  Series smoothed{.name = "smoothed, lag 1 s", .style = Style::line};
  Series sigma{.name = "what the filter says of itself (95 %)", .style = Style::band, .colour = Colour::blue};
  for (std::uint64_t i = 0; i < 12000; ++i) {
    const double t = static_cast<double>(i) / 120.0;
    const bool hidden = t > 40.0 && t < 44.0;
    const double e =
        0.003 + 0.002 * std::sin(0.2 * t) + 0.0015 * std::abs(spread(i)) + (i == 6800 ? 0.02 : 0.0);
    filtered.x.push_back(t);
    filtered.y.push_back(hidden ? kNan : e);
    smoothed.x.push_back(t);
    smoothed.y.push_back(0.55 * e);
    sigma.x.push_back(t);
    sigma.low.push_back(0.0);
    sigma.high.push_back(0.006 + 0.0015 * std::sin(0.2 * t + 0.4));
  }
  return {.id = "error-over-time",
          .title = "Error along one route",
          .x_label = "time (s)",
          .y_label = "distance from the truth (m)",
          .series = {sigma, filtered, smoothed},
          .horizontal = {{0.007, "aim: 99 % below 7 mm"}},
          .caption = "12 000 frames; from 40 to 44 s there was no pose. One frame is 20 mm off."};
}

Plot distribution() {
  std::vector<double> ours;
  std::vector<double> paper;
  std::vector<double> lost;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    ours.push_back(0.003 * std::exp(1.2 * spread(i)));
    paper.push_back(0.05 * std::exp(0.9 * spread(i + 50000)));
    lost.push_back(noise(i) < 0.1 ? kInf : 0.012 * std::exp(1.4 * spread(i + 90000)));
  }
  return {.id = "cdf",
          .title = "How errors are spread",
          .x_label = "error (m)",
          .y_label = "share of frames",
          .series = {cumulative("Skylight", ours), cumulative("the paper's filter", paper),
                     cumulative("without the filter, 10 % lost", lost)},
          .log_x = true,
          .y_range = {.low = 0.0, .high = 1.0},
          .vertical = {{0.003, "aim"}, {0.058, "paper"}}};
}

Plot histogram_plot() {
  std::vector<double> before;
  std::vector<double> after;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    before.push_back(0.03 * spread(i));
    after.push_back(0.012 * spread(i + 20000));
  }
  HistogramBins bins;
  for (int i = 0; i <= 20; ++i) bins.edges.push_back(-0.05 + 0.005 * i);
  return {.id = "histogram",
          .title = "Error along the way",
          .x_label = "error along the way (m)",
          .y_label = "share of frames",
          .series = {histogram("before", before, bins), histogram("after", after, bins)}};
}

Plot routes() {
  Series linear{.name = "linear", .style = Style::bars};
  Series aim{.name = "with the true camera", .style = Style::bars};
  Plot plot{
      .id = "routes", .title = "Error by route", .y_label = "mean error (m)", .horizontal = {{0.003, "aim"}}};
  for (int i = 0; i < 13; ++i) {
    plot.x_names.push_back(i < 8    ? "line " + std::to_string(i + 1)
                           : i < 10 ? "circle " + std::to_string(i - 7)
                                    : "chaotic " + std::to_string(i - 9));
    const double e = 0.0014 + 0.0016 * noise(static_cast<std::uint64_t>(i));
    linear.x.push_back(i);
    linear.y.push_back(e);
    linear.low.push_back(0.8 * e);
    linear.high.push_back(1.3 * e);
    aim.x.push_back(i);
    aim.y.push_back(0.4 * e);
  }
  linear.name = "with the calibrated camera";
  plot.series = {linear, aim};
  return plot;
}

Plot found_over_resolution() {
  Series found{.name = "",
               .x = {40, 75, 100, 125, 150, 165, 180, 200},
               .y = {0, 0, 0.08, 0.33, 0.6, 0.86, 1, 1},
               .style = Style::line_and_dots};
  return {.id = "found",
          .title = "Share found over the resolution",
          .x_label = "pixels per metre of floor",
          .y_label = "share found",
          .series = {found},
          .vertical = {{180.0, "used here"}},
          .horizontal = {{0.97, "the paper's 97 %"}}};
}

Plot convergence() {
  Plot plot{.id = "convergence",
            .title = "Prediction error over the horizon",
            .x_label = "horizon (s)",
            .y_label = "mean error (m)",
            .log_x = true,
            .log_y = true};
  const char* names[] = {"constant velocity", "constant turn rate", "with odometry", "several models"};
  for (int k = 0; k < 4; ++k) {
    Series series{.name = names[k]};
    for (double t = 0.05; t < 3.0; t *= 1.1) {
      series.x.push_back(t);
      series.y.push_back(0.002 + (0.02 + 0.02 * (3 - k)) * std::pow(t, 1.1 + 0.2 * k));
      series.low.push_back(0.7 * series.y.back());
      series.high.push_back(1.4 * series.y.back());
    }
    if (k > 0) series.low.clear();
    if (k > 0) series.high.clear();
    plot.series.push_back(series);
  }
  return plot;
}

Plot shapes() {
  Plot plot{.id = "shapes",
            .title = "Every shape of dots",
            .x_label = "trial",
            .y_label = "heading error (degrees)"};
  const char* names[] = {"orb", "alignment", "colour", "correlation", "tag", "homography"};
  for (std::uint64_t k = 0; k < 6; ++k) {
    Series series{.name = names[k], .style = Style::dots};
    for (std::uint64_t i = 0; i < 25; ++i) {
      series.x.push_back(static_cast<double>(i + 1));
      series.y.push_back(0.4 * static_cast<double>(k) + 0.3 * spread(100 * k + i));
    }
    plot.series.push_back(series);
  }
  return plot;
}

Table compared() {
  Table table{.id = "table-2",
              .title = "The paper's Table 2 beside ours",
              .columns = {{"route"},
                          {"mean", "m", "paper, before"},
                          {"dispersion", "m", "paper, before"},
                          {"mean", "m", "paper, after"},
                          {"dispersion", "m", "paper, after"},
                          {"mean", "m", "ours, before"},
                          {"mean", "m", "ours, after"},
                          {"before : after"}},
              .caption = "`dispersion` is the standard deviation, as in the paper."};
  const auto paper = [](double v) { return number(v, 3, Emphasis::paper); };
  table.rows.push_back({{text("linear"), paper(0.136), paper(0.045), paper(0.044), paper(0.015),
                         number(0.141, 3), number(0.047, 3, Emphasis::good), number(3.0, 2)}});
  table.rows.push_back({{text("curvilinear"), paper(0.125), paper(0.055), paper(0.072), paper(0.029),
                         number(0.119, 3), number(0.081, 3, Emphasis::bad), number(1.47, 2)}});
  table.rows.push_back({{text("average"), paper(0.130), paper(0.049), paper(0.058), paper(0.022),
                         number(0.130, 3), number(0.064, 3), number(2.03, 2)},
                        true});
  return table;
}

Table ablation() {
  Table table{.id = "ablation",
              .title = "Where the error comes from",
              .columns = {{"with"}, {"mean error", "mm"}, {"99th percentile", "mm"}, {"frames"}, {"remark"}}};
  table.rows.push_back({{text("everything"), number(2.61, 2), number(6.4, 1), number(1234567, 0), text("")}});
  table.rows.push_back(
      {{text("the true camera"), number(0.84, 2, Emphasis::good), number(2.2, 1), number(12345, 0),
        text("calibration is two thirds of the error, mostly by the camera's tilt")}});
  table.rows.push_back(
      {{text("no blur"), number(-0.01, 2), number(kNan, 1), number(999, 0), text("not measured")}});
  return table;
}

}  // namespace

// SplitMix64 (Steele, Lea and Flood, 2014).
double noise(std::uint64_t n) {
  std::uint64_t z = (n + 1) * 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
}

Document sample_document() {
  Gallery gallery{
      {trajectory("line-1", 0.0, 1), trajectory("circle-1", 0.02, 2), trajectory("chaotic-1", 0.11, 3)}};
  Document document{.title = "The paper reproduced: a sample",
                    .subtitle = "Every kind of part that a report can have. The figures are made up.",
                    .facts = {{"command", "`skylight reproduce --out report`"},
                              {"seeds", "1 to 10"},
                              {"version", "0.1.0"},
                              {"machine", "2 cores, 3.1 GHz"}}};
  document.sections = {
      {"short",
       "In short",
       1,
       {Paragraph{
            "The shape of the paper's results is there: the filter brings the error down, `alpha` hardly "
            "matters above 0.2 m."},
        Paragraph{"The ratio before to after is 2.03; the paper says 2.25.", Emphasis::good},
        Paragraph{"The curvilinear row is worse than the paper's.", Emphasis::bad},
        Paragraph{"\"With alpha greater than 0.2 m we get similar results.\"", Emphasis::paper}, compared()}},
      {"figures", "Figures of the paper", 1, {}},
      {"trajectories", "Trajectories", 2, {trajectory("fig-1", 0.09, 11), gallery}},
      {"sweeps", "Sweeps", 2, {sweep(), found_over_resolution()}},
      {"beat",
       "What the camera can do",
       1,
       {error_along_time(), distribution(), convergence(), histogram_plot(), routes(), shapes(), ablation()}},
      {"made",
       "How this was made",
       1,
       {List{{"rendered at 1920 x 1080", "detected once", "replayed for each `filter`"}, true},
        Preformatted{"skylight reproduce --out report\n  routes 13/13, seeds 10/10\n"}}}};
  return document;
}

}  // namespace skylight::service::report
