#include "service/sources/live/freeze_watch.hpp"

#include <cstring>

namespace skylight::service {

bool same_picture(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t row = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int y = 0; y < a.rows; ++y) {  // noise ends this in the first row
    if (std::memcmp(a.ptr(y), b.ptr(y), row) != 0) return false;
  }
  return true;
}

bool FreezeWatch::fresh(const cv::Mat& image, std::optional<Duration> stamp, Time arrived) {
  if (frozen_after_ <= Duration::zero()) return true;
  const bool first = last_.empty();
  by_stamp_ = !first && stamp && stamp_ && *stamp == *stamp_;
  if (!first && (by_stamp_ || same_picture(image, last_))) {
    frozen_ = arrived - since_ > frozen_after_;
    return false;
  }
  last_ = image;
  stamp_ = stamp;
  since_ = arrived;
  frozen_ = false;
  return true;
}

const char* FreezeWatch::reason() const {
  return by_stamp_ ? "its time stamps stand still" : "it repeats the same picture to the last bit";
}

}  // namespace skylight::service
