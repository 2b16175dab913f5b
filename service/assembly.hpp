// From a configuration to what runs: source, cameras, appearances, tracker.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "service/config.hpp"
#include "service/pipeline.hpp"
#include "service/sources/live/posted_cameras.hpp"
#include "service/sources/live_simulator.hpp"

namespace skylight::service {

using Appearances = std::map<std::string, std::shared_ptr<const Appearance>>;

struct Assembly {
  std::shared_ptr<FrameSource> source;
  std::shared_ptr<LiveSimulator> live;  ///< behind the source, where that is a simulator to be controlled
  PostedCameras posted;                 ///< those of its cameras whose frames come over HTTP
  std::vector<NamedCamera> cameras;
  Appearances appearances;
  std::vector<RobotSpec> robots;
  TrackerConfig tracker;
};

/// Opens the source and everything the configuration names. Appearances that are cut from a frame take the
/// source's first one (which is tracked all the same); their robots start where they stand there, unless
/// the configuration says otherwise. Throws SourceError, settings::Error or std::invalid_argument with one
/// line for people.
Assembly assemble(const Config& config);
/// The same over a simulator that is there already, whatever the configuration's source: to be controlled
/// while it runs, or to be run in lockstep.
Assembly assemble(const Config& config, std::shared_ptr<LiveSimulator> live);
Assembly assemble(const Config& config, std::shared_ptr<SimulatorFrames> simulator);

/// The tracker for an assembly's cameras and robots. Throws std::invalid_argument.
Tracker make_tracker(const Assembly& assembly);

/// Both for a pipeline. Throws as make_tracker().
PipelineParts pipeline_parts(const Assembly& assembly);

/// An appearance from a picture file or a box on a frame. `frame` may be null for a file. `cut_pose` (if
/// given) receives where the robot stands in that frame.
std::shared_ptr<const Appearance> make_appearance(const AppearanceConfig& config, const Frame* frame,
                                                  const CameraModel* camera, Pose2* cut_pose);

}  // namespace skylight::service
