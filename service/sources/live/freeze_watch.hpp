// Tells a picture that stands still from a scene that does.
//
// A sensor's noise makes two exposures differ in some pixel, however still the scene is; a picture that is
// the one before to the last bit is that one once more. So is one whose time stamp has not moved. A repeat is
// never new; repeats for longer than a bound mean that the camera (or what encodes for it) has frozen.
//
// Compression can hide the noise: a strongly compressed stream of an empty room may repeat pictures in
// earnest. That costs only age: nothing was new. Where even that is too much the watch is turned off.
#pragma once

#include <optional>

#include <opencv2/core/mat.hpp>

#include "tracker/types.hpp"

namespace skylight::service {

class FreezeWatch {
 public:
  /// `frozen_after`: of repeats; 0: never frozen, and no picture is a repeat.
  explicit FreezeWatch(Duration frozen_after) : frozen_after_(frozen_after) {}

  /// False for a repeat. `stamp` by the source's own clock, where it has one. Keeps the picture's header.
  bool fresh(const cv::Mat& image, std::optional<Duration> stamp, Time arrived);

  bool frozen() const { return frozen_; }
  /// When the picture last changed.
  Time since() const { return since_; }
  /// What stands still, for people.
  const char* reason() const;

  /// The source's clock may begin anew; the last picture is remembered.
  void reconnected() { stamp_.reset(); }

 private:
  Duration frozen_after_;
  cv::Mat last_;
  std::optional<Duration> stamp_;
  Time since_{};
  bool frozen_ = false;
  bool by_stamp_ = false;
};

/// To the last bit.
bool same_picture(const cv::Mat& a, const cv::Mat& b);

}  // namespace skylight::service
