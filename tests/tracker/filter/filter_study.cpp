// Prints the figures by which the motion filter's defaults were chosen, beside the window filter's on the
// same frames: skylight_filter_study [runs per cell, default 20]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "tests/tracker/filter/route_truth.hpp"
#include "tracker/filter/motion.hpp"
#include "tracker/filter/window.hpp"

namespace skylight::test {
namespace {

struct Errors {
  std::vector<double> place_m;
  std::vector<double> heading_rad;
  std::vector<double> nees;
  std::size_t inside = 0;

  void add(const Estimate& e, const Pose2& truth) {
    place_m.push_back(place_error(e.pose, truth));
    heading_rad.push_back(heading_error(e.pose, truth));
    nees.push_back(test::nees(e, truth));
    inside += nees_place(e, truth) < 5.991 ? 1 : 0;
  }
  static double mean(const std::vector<double>& v) {
    double sum = 0.0;
    for (const double x : v) sum += x;
    return v.empty() ? 0.0 : sum / static_cast<double>(v.size());
  }
  static double p99(std::vector<double> v) {
    if (v.empty()) return 0.0;
    std::sort(v.begin(), v.end());
    return v[static_cast<std::size_t>(0.99 * static_cast<double>(v.size() - 1))];
  }
};

struct Cell {
  RouteKind kind;
  double rate_hz;
  Detector detector;
};

struct Result {
  Errors window, filtered, smoothed, ahead, ahead1, ahead2;
  std::size_t frames = 0, none = 0;
};

void run(const Cell& cell, std::uint64_t seed, Result& result) {
  const Route route(cell.kind, 60.0, seed);
  Random random(seed + 1000);
  WindowFilter window;
  MotionFilter motion;
  const auto frames = static_cast<int>(56.0 * cell.rate_hz);
  const int lag = static_cast<int>(cell.rate_hz);
  for (int i = 0; i < frames; ++i) {
    const double t = i / cell.rate_hz;
    const Pose2 truth = route.at(t).pose;
    const auto seen = detect(cell.detector, truth, t, random);
    if (const auto w = window.update(instant(t), seen).estimate) result.window.add(*w, truth);
    const FilterStep step = motion.update(instant(t), seen);
    ++result.frames;
    if (!step.estimate) {
      ++result.none;
      continue;
    }
    result.filtered.add(*step.estimate, truth);
    if (i % 3 == 0) {
      result.ahead.add(*motion.predict(instant(t + 0.5)), route.at(t + 0.5).pose);
      result.ahead1.add(*motion.predict(instant(t + 1.0)), route.at(t + 1.0).pose);
      result.ahead2.add(*motion.predict(instant(t + 2.0)), route.at(t + 2.0).pose);
    }
    if (i >= lag) {
      const double back = (i - lag) / cell.rate_hz;
      if (const auto s = motion.smoothed(instant(back))) result.smoothed.add(*s, route.at(back).pose);
    }
  }
}

void routes(int runs) {
  std::printf(
      "route       Hz  noise  | window mean p99 mm, yaw mean deg | filtered mean p99, yaw, NEES, in95 | "
      "smoothed mean, yaw, NEES, in95 | 0.5 s ahead mean, NEES | 1 s NEES | 2 s mean, NEES | no pose\n");
  const char* names[] = {"line", "circle 2", "circle 1.25", "chaotic"};
  const char* noises[] = {"fine", "middle", "coarse", "paper"};
  const Detector detectors[] = {kFine, kMiddle, kCoarse, kPaper};
  for (int n = 0; n < 4; ++n) {
    for (int k = 0; k < 4; ++k) {
      for (const double rate : {30.0, 10.0}) {
        Result r;
        for (int seed = 1; seed <= runs; ++seed)
          run({static_cast<RouteKind>(k), rate, detectors[n]}, static_cast<std::uint64_t>(seed), r);
        const auto mm = [](const Errors& e) { return 1e3 * Errors::mean(e.place_m); };
        const auto deg = [](const Errors& e) { return Errors::mean(e.heading_rad) / kDegree; };
        const auto in = [](const Errors& e) {
          return 100.0 * static_cast<double>(e.inside) /
                 static_cast<double>(std::max<std::size_t>(1, e.place_m.size()));
        };
        std::printf(
            "%-11s %2.0f %-6s | %7.3f %8.3f %6.3f | %7.3f %8.3f %6.3f %5.2f %5.1f | %7.3f %6.3f %5.2f %5.1f "
            "| %7.2f %5.2f | "
            "%5.2f | %7.2f %5.2f | %zu\n",
            names[k], rate, noises[n], mm(r.window), 1e3 * Errors::p99(r.window.place_m), deg(r.window),
            mm(r.filtered), 1e3 * Errors::p99(r.filtered.place_m), deg(r.filtered),
            Errors::mean(r.filtered.nees), in(r.filtered), mm(r.smoothed), deg(r.smoothed),
            Errors::mean(r.smoothed.nees), in(r.smoothed), mm(r.ahead), Errors::mean(r.ahead.nees),
            Errors::mean(r.ahead1.nees), mm(r.ahead2), Errors::mean(r.ahead2.nees), r.none);
        std::fflush(stdout);
      }
    }
  }
}

/// 2 s without detections; before it, over `entry` s, an error that grows to 10 mm in a random direction.
void occlusions(int runs) {
  std::printf(
      "\nafter 2 s without detection | mean mm, worst mm, NEES: plain | with a biased burst of 10 mm over "
      "0.3 s\n");
  const char* names[] = {"line", "circle 2", "circle 1.25"};
  const Detector detectors[] = {kFine, kMiddle};
  const char* noises[] = {"fine", "middle"};
  for (int n = 0; n < 2; ++n) {
    for (int k = 0; k < 3; ++k) {
      for (const double rate : {30.0, 10.0}) {
        Errors errors[2];
        for (int burst = 0; burst < 2; ++burst) {
          for (int seed = 1; seed <= 2 * runs; ++seed) {
            const Route route(static_cast<RouteKind>(k), 20.0, static_cast<std::uint64_t>(seed));
            Random random(static_cast<std::uint64_t>(seed) + 5000);
            const double hidden = 6.0 + random.uniform(0.0, 6.0);
            const double way = random.uniform(-3.14, 3.14);
            MotionFilter filter;
            std::optional<Estimate> at_end;
            double t = 0.0;
            for (int i = 0; t < hidden + 2.0; ++i) {
              t = i / rate;
              auto seen = detect(detectors[n], route.at(t).pose, t, random);
              if (t >= hidden) seen.reset();
              if (seen && burst == 1) {
                const double ramp = std::clamp(1.0 - (hidden - t) / 0.3, 0.0, 1.0);
                seen->pose.x += 0.01 * ramp * std::cos(way);
                seen->pose.y += 0.01 * ramp * std::sin(way);
              }
              at_end = filter.update(instant(t), seen).estimate;
            }
            if (at_end) errors[burst].add(*at_end, route.at(t).pose);
          }
        }
        std::printf("%-11s %2.0f %-6s | %7.2f %7.2f %6.2f | %7.2f %7.2f %6.2f | %zu %zu\n", names[k], rate,
                    noises[n], 1e3 * Errors::mean(errors[0].place_m), 1e3 * Errors::p99(errors[0].place_m),
                    Errors::mean(errors[0].nees), 1e3 * Errors::mean(errors[1].place_m),
                    1e3 * Errors::p99(errors[1].place_m), Errors::mean(errors[1].nees),
                    errors[0].place_m.size(), errors[1].place_m.size());
      }
    }
  }
}

}  // namespace
}  // namespace skylight::test

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  skylight::test::routes(runs);
  skylight::test::occlusions(runs);
  return 0;
}
