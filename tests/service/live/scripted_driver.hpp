// A camera that does what a script says, on the test's own thread: no time passes but what the script lets
// pass.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "service/sources/live/camera_feed.hpp"

namespace skylight::service::test {

inline constexpr Time kMorning{std::chrono::seconds(1'700'000'000)};

/// What a sensor sees of a still scene: another picture each time, by its noise alone.
inline cv::Mat noisy_picture(std::uint64_t seed, cv::Size size = {32, 24}) {
  cv::Mat image(size, CV_8UC3);
  cv::RNG random(seed + 1);
  random.fill(image, cv::RNG::NORMAL, 120, 2);
  return image;
}

struct Script {
  Time now = kMorning;
  std::deque<std::string> open_failures;    ///< one for each open() that fails; then they succeed
  std::deque<std::function<Shot()>> reads;  ///< may throw; after the last one the feed is interrupted
  std::function<void()> at_end;
  std::vector<Duration> rests;
  int opens = 0;

  /// A picture that arrives so long after the morning.
  void picture(Duration after, cv::Mat image, std::function<void(Shot&)> change = {}) {
    reads.emplace_back([this, after, image = std::move(image), change = std::move(change)] {
      now = kMorning + after;
      Shot picture{.image = image, .arrived = now};
      if (change) change(picture);
      return picture;
    });
  }
  void breaks(const std::string& why) {
    reads.emplace_back([why]() -> Shot { throw SourceError(why); });
  }
  void look(std::function<void()> at) {
    reads.emplace_back([at = std::move(at)]() -> Shot {
      at();
      return {.unreadable = "a look"};
    });
  }
};

class ScriptedDriver final : public CameraDriver {
 public:
  explicit ScriptedDriver(Script& script) : script_(script) {}
  void open() override {
    ++script_.opens;
    if (script_.open_failures.empty()) return;
    const std::string why = script_.open_failures.front();
    script_.open_failures.pop_front();
    throw SourceError(why);
  }
  Shot read() override {
    if (script_.reads.empty()) {
      script_.at_end();
      throw SourceError("the script is over");
    }
    const auto next = std::move(script_.reads.front());
    script_.reads.pop_front();
    return next();
  }
  void close() override {}
  void interrupt() override {}

 private:
  Script& script_;
};

/// A feed over a script; run() returns when the script is over.
struct Scripted {
  explicit Scripted(FeedOptions options = {}) {
    options.clock = [this] { return script.now; };
    options.rest = [this](Duration duration) {
      script.rests.push_back(duration);
      script.now += duration;
      return true;
    };
    feed = std::make_unique<CameraFeed>(
        options, std::make_unique<ScriptedDriver>(script),
        CameraFeed::Listener{.frame = [this](Frame frame) { frames.push_back(std::move(frame)); },
                             .changed = [this] { states.push_back(feed->status()); }});
    script.at_end = [this] { feed->interrupt(); };
  }
  void run() { feed->run(); }

  Script script;
  std::vector<Frame> frames;
  std::vector<FeedStatus> states;  ///< each time that it told of another one
  std::unique_ptr<CameraFeed> feed;
};

}  // namespace skylight::service::test
