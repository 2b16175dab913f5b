// The simulator while people watch and interfere: it starts, pauses, steps, is told what to do, and says what
// is true. One thread takes frames, any number of others call the rest.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "service/sources/simulator.hpp"

namespace skylight::service {

enum class RunState : std::uint8_t { running, paused, ended };
std::string_view to_string(RunState state);

struct SimulatorStatus {
  RunState state = RunState::running;
  double speed = 1.0;
  Duration time{};           ///< of the scenario, since its start, up to the newest frame
  std::vector<Truth> truth;  ///< of the newest frame; empty before the first
  std::size_t camera = 0;    ///< that took it
  Time captured{};           ///< what it is stamped with for readers; 0 before the first
};

class LiveSimulator final : public FrameSource {
 public:
  /// `speed`: against real time, > 0. Runs from the beginning.
  LiveSimulator(std::unique_ptr<SimulatorFrames> frames, double speed);

  /// For what does not change while it runs: name, seed, duration, cameras, robots, start.
  const SimulatorFrames& shows() const { return *frames_; }

  // FrameSource, for the thread that takes frames. next() waits while it is paused. Frames come in the order
  // in which they are delivered, of several cameras not that of their capture; the world has run on
  // meanwhile.
  std::optional<Frame> next() override;
  Time delivered() const override { return delivered_; }
  std::optional<double> speed() const override;
  void stamped(Time at) override;
  void interrupt() override;

  SimulatorStatus status() const;

  // All but set_speed() are false, and nothing changes, where the scenario has ended.
  bool run();
  bool pause();
  /// Lets so many frames pass while it is paused. False too where it runs.
  bool step(int frames);
  void set_speed(double speed);

  /// As SimulatorFrames::act() and drive(), between two frames; how far the scenario's time is when it takes
  /// effect. None where the scenario has ended.
  std::optional<Duration> act(std::string_view json, const std::string& name);
  std::optional<Duration> drive(const DriveCommand& command);

  /// What took place so far, the oldest first; of a long run the newest kMaxHappenings.
  std::vector<Happening> happenings() const;
  static constexpr std::size_t kMaxHappenings = 10'000;

  /// The newest report of a robot, stamped by its clock on the wall's time; none before the first.
  std::optional<Odometry> odometry(const std::string& robot) const;

 private:
  class Turn;
  bool may_go() const { return waiting_ == 0 && (state_ == RunState::running || steps_ > 0); }
  struct UnderWay {
    Frame frame;
    Time delivered{};
    std::vector<Truth> truth;
  };
  bool draw();
  void hear();
  std::optional<UnderWay> first_to_arrive();
  Time wall_time(Time source) const;

  std::mutex frames_mutex_;  ///< held while the world moves or is acted upon; taken before mutex_
  std::unique_ptr<SimulatorFrames> frames_;
  std::vector<UnderWay> under_way_;  ///< drawn and not yet delivered, in the order of capture
  Time delivered_ = Time::min();     ///< of the thread that takes frames

  mutable std::mutex mutex_;  ///< guards the rest; held for moments only
  std::condition_variable wake_;
  RunState state_ = RunState::running;
  double speed_;
  int steps_ = 0;
  int waiting_ = 0;  ///< those who want to act go before the next frame
  bool interrupted_ = false;
  SimulatorStatus status_;
  Time source_captured_{};  ///< the newest frame's own stamp
  std::vector<Happening> happenings_;
  std::map<std::string, Odometry> odometry_;
};

}  // namespace skylight::service
