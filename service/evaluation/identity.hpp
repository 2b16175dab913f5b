// Who is who: which label stands for which robot among copies, and how often that is wrong.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "service/sources/simulator.hpp"

namespace skylight::service {

using Poses = std::vector<std::optional<Pose2>>;

/// Robots that look the same get their labels by chance: which of them the tracker calls anna and which
/// anna-2 is no error, as long as it stays so. A label is bound for good to the copy that it stands on
/// (within RobotMetrics::kUsableError) when it first stands on one that is still free; of several in one
/// frame the closest pair goes first. Until then a label with a pose goes, frame by frame, with the nearest
/// copy that is still free, so that its errors count. A robot without copies has its own label from the
/// start.
class LabelBinding {
 public:
  /// `look[i]`: any number that robot i shares with its copies and with nobody else.
  explicit LabelBinding(std::vector<std::size_t> look);

  /// `poses[i]`: what the tracker said of label i in this frame. Gives for each robot the label that stands
  /// for it in this frame, none where none does; labels and robots have the same numbers.
  std::vector<std::optional<std::size_t>> update(const std::vector<Truth>& truth, const Poses& poses);

 private:
  std::vector<std::size_t> look_;
  std::vector<std::optional<std::size_t>> label_of_;  ///< by robot, bound for good
  std::vector<bool> bound_;                           ///< by label
};

/// Counts over frames what identity comes to, robots' poses given by their own labels.
///
/// A robot counts from its first frame in view on, while it is present, also where it is hidden: where it is
/// remains the question. A pose nearest to its own robot (within kUsableError) is right; elsewhere it is
/// wrong; a switch is a label that stands on another robot than the one it stood on last. IDF1 = 2 right /
/// (robots + poses) (Ristani et al. 2016, eq. 11, with the labels' own robots as their match); MOTA = 1 -
/// (misses + wrong + switches) / robots (Bernardin and Stiefelhagen 2008, eq. 2).
class IdentityTally {
 public:
  /// `poses[i]`: of the label of truth[i].
  void add(const std::vector<Truth>& truth, const Poses& poses);
  /// Adds another run's counts; what stood where last is this run's own.
  void merge(const IdentityTally& other);

  /// How many poses were judged.
  std::size_t poses() const { return poses_; }
  std::size_t switches() const { return switches_; }
  double idf1() const;
  double mota() const;

 private:
  std::vector<std::size_t> at_;  ///< on which robot each label stood last; their number: on none yet
  std::vector<bool> seen_;
  std::size_t truths_ = 0;
  std::size_t poses_ = 0;
  std::size_t right_ = 0;
  std::size_t switches_ = 0;
};

}  // namespace skylight::service
