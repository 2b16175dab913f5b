// A camera whose pictures some other program brings: POST /api/v1/cameras/{id}/frames.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>

#include "service/clock.hpp"
#include "service/sources/live/driver.hpp"

namespace skylight::service {

struct PostedOptions {
  cv::Size size_px{};
  /// The stamps that come with the pictures are by our clock (the same machine, or both are synchronised);
  /// else by a clock of their own, whose offset is estimated from the arrivals.
  bool synchronised = true;
  /// Without a picture for so long it counts as failed.
  Duration silence = std::chrono::seconds(5);
};

/// Where the route leaves pictures and the feed finds them. The newest waits, one that nobody took counts as
/// lost. Any number of threads may post.
class PostedPictures {
 public:
  explicit PostedPictures(PostedOptions options) : options_(options) {}
  const PostedOptions& options() const { return options_; }

  /// `stamp`: Unix time of the exposure's midpoint by whoever posts; none: it is dated by its arrival.
  void post(cv::Mat image, std::optional<Time> stamp, Time arrived);

  /// The next one; none when it was silent for options().silence, or interrupted.
  std::optional<Shot> take();
  void interrupt();

 private:
  PostedOptions options_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::optional<Shot> newest_;
  bool interrupted_ = false;
};

class PostedCamera final : public CameraDriver {
 public:
  explicit PostedCamera(std::shared_ptr<PostedPictures> pictures) : pictures_(std::move(pictures)) {}
  void open() override {}
  Shot read() override;
  void close() override {}
  void interrupt() override { pictures_->interrupt(); }

 private:
  std::shared_ptr<PostedPictures> pictures_;
};

}  // namespace skylight::service
