#include "service/evaluation/identity.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "tracker/metrics.hpp"

namespace skylight::service {
namespace {

std::size_t nearest(const std::vector<Truth>& truth, const Pose2& pose) {
  std::size_t best = truth.size();
  double least = RobotMetrics::kUsableError;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i].present) continue;
    const double apart = (truth[i].pose.position() - pose.position()).norm();
    if (apart < least) {
      least = apart;
      best = i;
    }
  }
  return best;
}

}  // namespace

LabelBinding::LabelBinding(std::vector<std::size_t> look)
    : look_(std::move(look)), label_of_(look_.size()), bound_(look_.size(), false) {
  for (std::size_t i = 0; i < look_.size(); ++i) {
    if (std::count(look_.begin(), look_.end(), look_[i]) > 1) continue;
    label_of_[i] = i;
    bound_[i] = true;
  }
}

std::vector<std::optional<std::size_t>> LabelBinding::update(const std::vector<Truth>& truth,
                                                             const Poses& poses) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;  // distance, robot, label
  for (std::size_t label = 0; label < poses.size(); ++label) {
    if (bound_[label] || !poses[label]) continue;
    for (std::size_t robot = 0; robot < truth.size(); ++robot) {
      if (label_of_[robot] || !truth[robot].present || look_[robot] != look_[label]) continue;
      pairs.emplace_back((truth[robot].pose.position() - poses[label]->position()).norm(), robot, label);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  auto now = label_of_;
  std::vector<bool> taken = bound_;
  for (const auto& [apart, robot, label] : pairs) {
    if (now[robot] || taken[label]) continue;
    now[robot] = label;
    taken[label] = true;
    if (apart >= RobotMetrics::kUsableError) continue;
    label_of_[robot] = label;
    bound_[label] = true;
  }
  return now;
}

void IdentityTally::add(const std::vector<Truth>& truth, const Poses& poses) {
  at_.resize(truth.size(), truth.size());
  seen_.resize(truth.size(), false);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    seen_[i] = seen_[i] || (truth[i].in_view && truth[i].present);
    if (!seen_[i] || !truth[i].present) continue;
    ++truths_;
    if (!poses[i]) continue;
    ++poses_;
    const std::size_t at = nearest(truth, *poses[i]);
    right_ += at == i ? 1 : 0;
    if (at == truth.size()) continue;
    const std::size_t before = at_[i] < truth.size() ? at_[i] : i;
    switches_ += before != at ? 1 : 0;
    at_[i] = at;
  }
}

void IdentityTally::merge(const IdentityTally& other) {
  truths_ += other.truths_;
  poses_ += other.poses_;
  right_ += other.right_;
  switches_ += other.switches_;
}

double IdentityTally::idf1() const {
  const auto all = static_cast<double>(truths_ + poses_);
  return all > 0 ? 2.0 * static_cast<double>(right_) / all : 1.0;
}

double IdentityTally::mota() const {
  const auto misses = static_cast<double>(truths_ - right_);
  const auto wrong = static_cast<double>(poses_ - right_);
  const auto all = static_cast<double>(truths_);
  return all > 0 ? 1.0 - (misses + wrong + static_cast<double>(switches_)) / all : 1.0;
}

}  // namespace skylight::service
