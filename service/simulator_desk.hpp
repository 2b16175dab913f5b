// Where a running service changes its scenario: another one, or the same from its beginning.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "service/assembly.hpp"

namespace skylight::service {

class AppearanceStore;

class SimulatorDesk {
 public:
  /// `config` and `live` as the pipeline was assembled from; `live` is null where its source is no simulator.
  SimulatorDesk(Config config, std::shared_ptr<LiveSimulator> live, Pipeline& pipeline,
                AppearanceStore& appearances);

  struct Running {
    std::shared_ptr<LiveSimulator> live;  ///< null where the source is no simulator
    std::string scenario;                 ///< as load() takes it; of another file its own name
  };
  Running running() const;

  /// Loads one of the scenarios that come with Skylight; cameras, appearances and robots become its own, the
  /// speed stays. It begins running, or paused where the one before was paused. Where it throws, what ran
  /// runs on: SourceError (no such scenario), settings::Error or std::invalid_argument (it is none that can
  /// be run).
  void load(const std::string& scenario, std::optional<std::uint64_t> seed);
  /// The scenario that runs, from its beginning. Throws as load().
  void reset();

 private:
  void begin(const Config& config);

  Pipeline& pipeline_;
  AppearanceStore& appearances_;
  std::mutex changing_;  ///< one change at a time
  Config config_;        ///< under `changing_`
  mutable std::mutex mutex_;
  Running running_;
};

}  // namespace skylight::service
