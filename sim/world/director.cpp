#include "sim/world/director.hpp"

#include <algorithm>
#include <utility>

namespace skylight::sim {

Director::Director(std::vector<EventSpec> events) : events_(std::move(events)), progress_(events_.size()) {}

std::vector<std::size_t> Director::due(Duration time, const Situation& situation) {
  std::vector<std::size_t> now;
  // What happens may let others follow at once: look again until nothing more does.
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      if (std::find(now.begin(), now.end(), i) != now.end() || !is_due(i, time, situation)) continue;
      now.push_back(i);
      more = true;
      Progress& progress = progress_[i];
      if (!progress.first) {
        progress.first = time;
        progress.next = events_[i].at_s ? from_seconds(*events_[i].at_s) : time;
      }
      const Duration every = from_seconds(events_[i].every_s);
      if (every.count() > 0) progress.next += ((time - progress.next) / every + 1) * every;
      if (!events_[i].name.empty()) happened_.insert(events_[i].name);
    }
  }
  return now;
}

bool Director::is_due(std::size_t event, Duration time, const Situation& situation) const {
  const EventSpec& spec = events_[event];
  const Progress& progress = progress_[event];
  if (progress.first) return spec.every_s > 0.0 && time >= progress.next;
  if (spec.at_s) return time >= from_seconds(*spec.at_s);
  return spec.when && holds(*spec.when, time, situation);
}

bool Director::holds(const Condition& condition, Duration time, const Situation& situation) const {
  struct Judge {
    const Director& director;
    Duration time;
    const Situation& situation;

    bool operator()(const AfterEvent& after) const {
      for (std::size_t i = 0; i < director.events_.size(); ++i) {
        const auto& first = director.progress_[i].first;
        if (director.events_[i].name == after.event && first)
          return time >= *first + from_seconds(after.delay_s);
      }
      return false;
    }
    bool operator()(const RobotAt& at) const {
      const auto place = situation.place_of(at.robot);
      return place &&
             (place->position() - Eigen::Vector2d(at.place_m[0], at.place_m[1])).norm() <= at.within_m;
    }
    bool operator()(const RobotsNear& near) const {
      const auto one = situation.place_of(near.robot);
      const auto other = situation.place_of(near.other);
      return one && other && (one->position() - other->position()).norm() <= near.within_m;
    }
    bool operator()(const RobotTouches& touches) const { return situation.touches_something(touches.robot); }
    bool operator()(const ProgramDone& done) const { return situation.program_done(done.robot); }
  };
  return std::visit(Judge{*this, time, situation}, condition.is);
}

}  // namespace skylight::sim
