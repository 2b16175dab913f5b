#include "service/sources/live/posted_camera.hpp"

#include <utility>

namespace skylight::service {

void PostedPictures::post(cv::Mat image, std::optional<Time> stamp, Time arrived) {
  Shot picture{.image = std::move(image), .arrived = arrived};
  if (stamp) {
    picture.stamp = stamp->time_since_epoch();
    picture.stamp_is_unix = true;
    if (options_.synchronised) picture.captured = stamp;
  }
  {
    const std::lock_guard lock(mutex_);
    if (newest_) picture.lost = newest_->lost + 1;
    newest_ = std::move(picture);
  }
  wake_.notify_all();
}

std::optional<Shot> PostedPictures::take() {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, options_.silence, [this] { return interrupted_ || newest_.has_value(); });
  if (interrupted_) return std::nullopt;
  return std::exchange(newest_, std::nullopt);
}

void PostedPictures::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
  }
  wake_.notify_all();
}

Shot PostedCamera::read() {
  auto picture = pictures_->take();
  if (!picture)
    throw SourceError(
        "no frame was posted for " +
        std::to_string(
            std::chrono::duration_cast<std::chrono::seconds>(pictures_->options().silence).count()) +
        " s");
  return std::move(*picture);
}

}  // namespace skylight::service
