// Prints the figures by which the motion filter's defaults were chosen, beside the window filter's on the
// same frames: skylight_filter_study [runs per cell, default 20]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
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
    if (i >= lag && i % 3 == 0) {
      const double back = (i - lag) / cell.rate_hz;
      if (const auto s = motion.smoothed(instant(back))) result.smoothed.add(*s, route.at(back).pose);
    }
  }
}

const char* route_name(RouteKind kind) {
  constexpr std::array kNames{"line", "circle 2", "circle 1.25", "chaotic"};
  return kNames.at(static_cast<std::size_t>(kind));
}

void routes(int runs) {
  std::printf(
      "route       Hz  noise  | window mean p99 mm, yaw mean deg | filtered mean p99, yaw, NEES, in95 | "
      "smoothed mean, yaw, NEES, in95 | 0.5 s ahead mean, NEES | 1 s NEES | 2 s mean, NEES | no pose\n");
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
            route_name(static_cast<RouteKind>(k)), rate, noises[n], mm(r.window),
            1e3 * Errors::p99(r.window.place_m), deg(r.window), mm(r.filtered),
            1e3 * Errors::p99(r.filtered.place_m), deg(r.filtered), Errors::mean(r.filtered.nees),
            in(r.filtered), mm(r.smoothed), deg(r.smoothed), Errors::mean(r.smoothed.nees), in(r.smoothed),
            mm(r.ahead), Errors::mean(r.ahead.nees), Errors::mean(r.ahead1.nees), mm(r.ahead2),
            Errors::mean(r.ahead2.nees), r.none);
        std::fflush(stdout);
      }
    }
  }
}

struct Hidden {
  RouteKind kind;
  double rate_hz;
  Detector detector;
  bool burst;
};

/// 2 s without detections; before it, where asked for, over 0.3 s an error that grows to 10 mm in a random
/// direction. At reappearance.
Errors hidden(const Hidden& how, double entry_bias_m, int runs) {
  Errors errors;
  for (int seed = 1; seed <= runs; ++seed) {
    const Route route(how.kind, 20.0, static_cast<std::uint64_t>(seed));
    Random random(static_cast<std::uint64_t>(seed) + 5000);
    const double from = 6.0 + random.uniform(0.0, 6.0);
    const double way = random.uniform(-3.14, 3.14);
    MotionFilter filter({.entry_bias_m = entry_bias_m});
    std::optional<Estimate> at_end;
    double t = 0.0;
    for (int i = 0; t < from + 2.0; ++i) {
      t = i / how.rate_hz;
      auto seen = detect(how.detector, route.at(t).pose, t, random);
      if (t >= from) seen.reset();
      if (seen && how.burst) {
        const double ramp = std::clamp(1.0 - (from - t) / 0.3, 0.0, 1.0);
        seen->pose.x += 0.01 * ramp * std::cos(way);
        seen->pose.y += 0.01 * ramp * std::sin(way);
      }
      at_end = filter.update(instant(t), seen).estimate;
    }
    if (at_end) errors.add(*at_end, route.at(t).pose);
  }
  return errors;
}

void occlusions(int runs) {
  std::printf(
      "\nafter 2 s hidden, mean / p99 mm: plain | with a biased burst before | the same, last frames "
      "believed\n");
  for (const RouteKind kind : {RouteKind::line, RouteKind::circle_2m, RouteKind::circle_1m25}) {
    for (const double rate : {30.0, 10.0}) {
      const Errors plain = hidden({kind, rate, kFine, false}, 0.01, runs);
      const Errors burst = hidden({kind, rate, kFine, true}, 0.01, runs);
      const Errors believed = hidden({kind, rate, kFine, true}, 0.0, runs);
      std::printf("%-11s %2.0f fine | %6.1f %6.1f | %6.1f %6.1f | %6.1f %6.1f\n", route_name(kind), rate,
                  1e3 * Errors::mean(plain.place_m), 1e3 * Errors::p99(plain.place_m),
                  1e3 * Errors::mean(burst.place_m), 1e3 * Errors::p99(burst.place_m),
                  1e3 * Errors::mean(believed.place_m), 1e3 * Errors::p99(believed.place_m));
    }
  }
}

/// Detectors that claim another noise than they have: with and without NoiseJudge.
void claims(int runs) {
  std::printf("\nclaimed sigma / true sigma: mean mm, NEES | all claims believed\n");
  for (const Detector& base : {kMiddle, kCoarse}) {
    for (const double claimed : {0.2, 0.4, 0.7, 1.0, 3.0}) {
      std::array<Errors, 2> errors;
      for (std::size_t which = 0; which < 2; ++which) {
        for (int seed = 1; seed <= runs; ++seed) {
          Detector detector = base;
          detector.claimed = claimed;
          const Route route(RouteKind::circle_1m25, 40.0, static_cast<std::uint64_t>(seed));
          Random random(static_cast<std::uint64_t>(seed) + 40);
          MotionFilter filter({.max_noise_scale = which == 0 ? 10.0 : 1.0});
          for (int i = 0; i < 1140; ++i) {
            const double t = i / 30.0;
            const Pose2 truth = route.at(t).pose;
            const auto e = filter.update(instant(t), detect(detector, truth, t, random)).estimate;
            if (e) errors[which].add(*e, truth);
          }
        }
      }
      std::printf("%5.1f mm, %3.1f | %7.2f %6.2f | %7.2f %6.2f\n", 1e3 * base.sigma_m, claimed,
                  1e3 * Errors::mean(errors[0].place_m), Errors::mean(errors[0].nees),
                  1e3 * Errors::mean(errors[1].place_m), Errors::mean(errors[1].nees));
    }
  }
}

using motion::Gaussian6;
using motion::Matrix6;
using motion::ModelStep;
using motion::Vector6;

/// The unscented prediction (S. J. Julier, J. K. Uhlmann, Proc. IEEE 92(3), 2004, kappa = 0).
Gaussian6 unscented(const ModelStep& step, const Gaussian6& from) {
  const Matrix6 root = Eigen::LLT<Matrix6>(6.0 * from.cov).matrixL();
  std::array<Vector6, 12> points;
  Gaussian6 out;
  out.mean.setZero();
  for (int i = 0; i < 12; ++i) {
    const double sign = i < 6 ? 1.0 : -1.0;
    points.at(static_cast<std::size_t>(i)) = step.move(from.mean + sign * root.col(i % 6));
    out.mean += points.at(static_cast<std::size_t>(i)) / 12.0;
  }
  out.cov = step.noise(from.mean);
  for (const Vector6& p : points) out.cov += (p - out.mean) * (p - out.mean).transpose() / 12.0;
  return out;
}

/// Extended or unscented: both against 20,000 samples, over times that a prediction takes.
void transforms() {
  std::printf("\nmean's error mm / position sigma over the sampled one: extended | unscented\n");
  const motion::ModelBank bank = motion::model_bank({});
  struct Start {
    const char* name;
    double sigma_m, sigma_yaw, sigma_u, sigma_w;
  };
  for (const Start& start : {Start{"fine", 5e-5, 2e-4, 3e-3, 5e-3}, Start{"coarse", 0.025, 0.05, 0.02, 0.02},
                             Start{"just found", 0.1, 0.17, 0.3, 0.6}}) {
    for (const double ahead : {0.1, 0.5, 2.0}) {
      const auto steps = static_cast<int>(std::lround(ahead / 0.1));
      const ModelStep step(bank.model[motion::kAdjusting], 0.1);
      Gaussian6 from;
      from.mean << 0.0, 0.0, 0.3, 0.22, 0.0, 0.3;
      Vector6 sigma;
      sigma << start.sigma_m, start.sigma_m, start.sigma_yaw, start.sigma_u, 1e-3, start.sigma_w;
      from.cov = sigma.cwiseAbs2().asDiagonal();
      Gaussian6 extended = from;
      Gaussian6 other = from;
      for (int i = 0; i < steps; ++i) {
        extended = step.predict(extended);
        other = unscented(step, other);
      }
      constexpr int kSamples = 20000;
      Random random(9);
      Vector6 mean = Vector6::Zero();
      Matrix6 square = Matrix6::Zero();
      for (int n = 0; n < kSamples; ++n) {
        Vector6 x = from.mean;
        for (int c = 0; c < 6; ++c) x[c] += sigma[c] * random.normal();
        for (int i = 0; i < steps; ++i) {
          const Matrix6 root = Eigen::LLT<Matrix6>(step.noise(x)).matrixL();
          Vector6 kick;
          for (int c = 0; c < 6; ++c) kick[c] = random.normal();
          x = step.move(x) + root * kick;
        }
        mean += x / kSamples;
        square += x * x.transpose() / kSamples;
      }
      const Matrix6 cov = square - mean * mean.transpose();
      const auto spread = [](const Matrix6& m) { return std::sqrt(m(0, 0) + m(1, 1)); };
      std::printf("%-10s %3.1f s | %7.3f %5.2f | %7.3f %5.2f\n", start.name, ahead,
                  1e3 * (extended.mean - mean).head<2>().norm(), spread(extended.cov) / spread(cov),
                  1e3 * (other.mean - mean).head<2>().norm(), spread(other.cov) / spread(cov));
    }
  }
}

void times() {
  const Route route(RouteKind::chaotic, 70.0, 1);
  Random random(1);
  std::vector<std::optional<Observation>> seen;
  for (int i = 0; i < 2000; ++i) seen.push_back(detect(kMiddle, route.at(i / 30.0).pose, i / 30.0, random));
  const auto microseconds = [&](bool hides, bool smooths) {
    MotionFilter filter;
    const std::clock_t before = std::clock();  // of this process: others do not count
    for (int i = 0; i < 2000; ++i) {
      const bool hidden_now = hides && i % 60 > 30;
      filter.update(instant(i / 30.0), hidden_now ? std::nullopt : seen[static_cast<std::size_t>(i)]);
      if (smooths && i > 40) (void)filter.smoothed(instant(i / 30.0 - 1.0));
    }
    return static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC / 2000.0 * 1e6;
  };
  const double plain = microseconds(false, false);
  std::printf(
      "\nmicroseconds: update %.1f, with a gap of 1 s in every 2 %.1f, smoothed(1 s back at 30 Hz) %.0f\n",
      plain, microseconds(true, false), microseconds(false, true) - plain);
}

}  // namespace
}  // namespace skylight::test

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  skylight::test::routes(runs);
  skylight::test::occlusions(2 * runs);
  skylight::test::claims(runs / 4 + 1);
  skylight::test::transforms();
  skylight::test::times();
  return 0;
}
