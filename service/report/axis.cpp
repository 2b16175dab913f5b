#include "service/report/axis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

constexpr int kFewest = 3;
constexpr int kMost = 10;
constexpr double kLargest = 1e100;
constexpr double kOnTick = 1e-9;  // shares of a step that count as rounding

// 1, 2 or 5 times a power of ten; multiples are exact to the last bit.
struct Step {
  int mantissa = 1;
  int exponent = 0;
  double times(double k) const {
    const double power = std::pow(10.0, std::abs(exponent));
    return exponent >= 0 ? k * mantissa * power : k * mantissa / power;
  }
};

struct Ends {
  double low = 0.0, high = 1.0;
  bool low_fixed = false, high_fixed = false;
};

// Multiples of a step from first to last.
struct Run {
  double first = 0.0, last = 0.0;
  int count() const { return static_cast<int>(std::clamp(last - first + 1.0, 0.0, 1e6)); }
};

Run run_of(const Step& step, const Ends& ends) {
  const double unit = step.times(1.0);
  const double low = ends.low / unit;
  const double high = ends.high / unit;
  return {ends.low_fixed ? std::ceil(low - kOnTick) : std::floor(low + kOnTick),
          ends.high_fixed ? std::floor(high + kOnTick) : std::ceil(high - kOnTick)};
}

// How far a choice is from the wish: in ticks too many or too few, and in room that rounding outwards leaves
// empty.
double cost_of(const Step& step, const Run& run, const Ends& ends, int wished) {
  constexpr double kTicksPerEmptyShare = 15.0;
  const double low = ends.low_fixed ? ends.low : step.times(run.first);
  const double high = ends.high_fixed ? ends.high : step.times(run.last);
  const double empty = 1.0 - (ends.high - ends.low) / (high - low);
  return std::abs(run.count() - wished) + kTicksPerEmptyShare * empty;
}

// The best step that gives from 3 to 10 ticks; `above_zero` refuses ticks that a log axis cannot have.
Step choose_step(const Ends& ends, int wished, bool above_zero) {
  const int magnitude = static_cast<int>(std::floor(std::log10(ends.high - ends.low)));
  Step best{.mantissa = 1, .exponent = magnitude - 1};
  double least = 1e9;
  for (int exponent = magnitude + 1; exponent >= magnitude - 2; --exponent) {
    for (const int mantissa : {5, 2, 1}) {
      const Step step{mantissa, exponent};
      const Run run = run_of(step, ends);
      if (run.count() < kFewest || run.count() > kMost || (above_zero && run.first <= 0.0)) continue;
      const double cost = cost_of(step, run, ends, wished);
      if (cost >= least) continue;
      best = step;
      least = cost;
    }
  }
  return best;
}

int exponent_of(double value) {
  return static_cast<int>(std::floor(std::log10(value) + 1e-12));
}

// Plain digits where they are short, powers of ten where they are not.
std::vector<std::string> step_labels(const std::vector<double>& ticks, const Step& step) {
  double largest = 0.0;
  for (const double tick : ticks) largest = std::max(largest, std::abs(tick));
  const int top = largest > 0.0 ? exponent_of(largest) : 0;
  const bool usual = step.exponent >= -4 && top < 6;
  const bool fine =
      top - step.exponent > 5 && step.exponent >= -9 && top < 12;  // a long mantissa is no shorter
  const bool in_digits = usual || fine;
  std::vector<std::string> out;
  for (const double tick : ticks) {
    if (in_digits) {
      out.push_back(plain(tick, std::max(0, -step.exponent)));
    } else {
      out.push_back(tick == 0.0 ? "0" : scientific(tick / std::pow(10.0, top), top - step.exponent, top));
    }
  }
  return out;
}

void set_linear_ticks(Axis& axis, const Step& step, const Ends& ends) {
  const Run run = run_of(step, ends);
  for (int k = 0; k < run.count(); ++k) axis.ticks.push_back(step.times(run.first + k));
  axis.labels = step_labels(axis.ticks, step);
  axis.step = step.times(1.0);
  axis.low = ends.low_fixed ? ends.low : axis.ticks.front();
  axis.high = ends.high_fixed ? ends.high : axis.ticks.back();
}

// A ladder of rungs on a log axis: three a decade (1-2-5) or one in so many decades.
struct Ladder {
  int decades_between = 0;  ///< 0: three a decade
  double rung(int k) const {
    if (decades_between > 0) return std::pow(10.0, k * decades_between);
    const int decade = static_cast<int>(std::floor(k / 3.0));
    constexpr std::array<int, 3> kMantissas{1, 2, 5};
    return Step{kMantissas.at(static_cast<std::size_t>(k - 3 * decade)), decade}.times(1.0);
  }
  int near(double value) const {  // within one rung
    const double per_decade = decades_between > 0 ? 1.0 / decades_between : 3.0;
    return static_cast<int>(std::floor(std::log10(value) * per_decade));
  }
  std::vector<double> rungs(const Ends& ends) const {
    const double low = ends.low * (1.0 + kOnTick);
    const double high = ends.high * (1.0 - kOnTick);
    int first = near(ends.low) - 2;
    while (rung(first + 1) <= low) ++first;  // the last one at or below the low end
    if (ends.low_fixed && rung(first) < ends.low * (1.0 - kOnTick)) ++first;
    int last = near(ends.high) + 3;
    while (rung(last - 1) >= high) --last;
    if (ends.high_fixed && rung(last) > ends.high * (1.0 + kOnTick)) --last;
    std::vector<double> out;
    for (int k = first; k <= last; ++k) out.push_back(rung(k));
    return out;
  }
};

std::string log_label(double tick) {
  const int exponent = exponent_of(tick);
  if (exponent >= -4 && exponent < 5) return plain(tick, std::max(0, -exponent));
  return scientific(tick / std::pow(10.0, exponent), 0, exponent);
}

void set_log_ticks(Axis& axis, const Ends& ends, int wished) {
  int best_distance = 1000;
  for (const int decades : {0, 1, 2, 5, 10, 20, 50}) {
    const std::vector<double> ticks = Ladder{decades}.rungs(ends);
    const int count = static_cast<int>(ticks.size());
    const int distance = std::abs(count - wished);
    if (count < kFewest || count > kMost || distance >= best_distance) continue;
    best_distance = distance;
    axis.ticks = ticks;
  }
  if (axis.ticks.empty()) {  // less than a decade: as on a linear axis
    set_linear_ticks(axis, choose_step(ends, wished, true), ends);
    axis.step = 0.0;
    return;
  }
  for (const double tick : axis.ticks) axis.labels.push_back(log_label(tick));
  axis.low = ends.low_fixed ? ends.low : axis.ticks.front();
  axis.high = ends.high_fixed ? ends.high : axis.ticks.back();
}

// Apart by enough that a double can count ticks between them.
Ends ends_of(const AxisWish& wish) {
  Ends ends{.low = wish.fixed.low.value_or(wish.low),
            .high = wish.fixed.high.value_or(wish.high),
            .low_fixed = wish.fixed.low.has_value(),
            .high_fixed = wish.fixed.high.has_value()};
  // A fixed end may lie beyond all the data: then the free end is as good as unknown.
  if (ends.low_fixed && !ends.high_fixed) ends.high = std::max(ends.high, ends.low);
  if (ends.high_fixed && !ends.low_fixed) ends.low = std::min(ends.low, ends.high);
  const double largest = std::max(std::abs(ends.low), std::abs(ends.high));
  if (ends.high - ends.low > 1e-9 * largest) return ends;
  const double reach = largest > 0.0 ? 0.1 * largest : 1.0;
  if (!ends.low_fixed) ends.low -= reach;
  if (!ends.high_fixed) ends.high += reach;
  return ends;
}

// Ends of one side of a map, with a margin. A straight route has no width: it gets some, so that the map is
// no strip.
Ends map_ends(const AxisWish& side, const AxisWish& other_side) {
  Ends ends = ends_of(side);
  const Ends other = ends_of(other_side);
  const double longer = std::max(ends.high - ends.low, other.high - other.low);
  const double missing = std::max(0.0, 0.25 * longer - (ends.high - ends.low));
  const double margin = 0.04 * longer + missing / 2.0;
  if (!ends.low_fixed) ends.low -= margin;
  if (!ends.high_fixed) ends.high += margin;
  ends.low_fixed = ends.high_fixed = true;  // they stay where they are, between ticks
  return ends;
}

}  // namespace

bool drawable(double value, bool log) {
  return std::isfinite(value) && std::abs(value) <= kLargest && (!log || value >= 1.0 / kLargest);
}

double Axis::share(double value) const {
  return log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
}

Axis make_axis(const AxisWish& wish) {
  Axis axis{.log = wish.log};
  AxisWish flushed = wish;  // denormals have no decimal step
  if (!wish.log && std::max(std::abs(wish.low), std::abs(wish.high)) < 1.0 / kLargest)
    flushed.low = flushed.high = 0.0;
  const Ends ends = ends_of(flushed);
  if (wish.log) {
    set_log_ticks(axis, ends, wish.ticks);
  } else {
    set_linear_ticks(axis, choose_step(ends, wish.ticks, false), ends);
  }
  return axis;
}

AxisPair make_equal_axes(const AxisWish& x, const AxisWish& y) {
  Ends across = map_ends(x, y);
  Ends upward = map_ends(y, x);
  const bool is_wide = across.high - across.low >= upward.high - upward.low;
  const Ends& longer = is_wide ? across : upward;
  Ends& shorter = is_wide ? upward : across;
  const Range& fixed = is_wide ? y.fixed : x.fixed;
  const int wished = std::min(x.ticks, y.ticks);
  Step step = choose_step(longer, wished, false);
  for (int more = wished; more <= kMost && run_of(step, shorter).count() < kFewest; ++more) {
    step = choose_step(longer, more, false);
  }
  while (!fixed.low && !fixed.high && run_of(step, shorter).count() < kFewest) {
    shorter.low -= step.times(0.25);
    shorter.high += step.times(0.25);
  }
  const bool shared = run_of(step, shorter).count() >= kFewest;
  AxisPair out;
  set_linear_ticks(out.x, shared || is_wide ? step : choose_step(across, x.ticks, false), across);
  set_linear_ticks(out.y, shared || !is_wide ? step : choose_step(upward, y.ticks, false), upward);
  return out;
}

Axis named_axis(const std::vector<std::string>& names) {
  Axis axis{.low = -0.5, .high = static_cast<double>(names.size()) - 0.5, .labels = names};
  for (std::size_t i = 0; i < names.size(); ++i) axis.ticks.push_back(static_cast<double>(i));
  return axis;
}

}  // namespace skylight::service::report
