#include "service/reproduce/watch.hpp"

#include <utility>

namespace skylight::service::reproduce {

ObservedRun watch(SimulatorFrames& simulator, const std::string& route, std::vector<std::string> variants,
                  const Look& look) {
  const SimulatedCamera& camera = simulator.cameras().at(0);
  ObservedRun run{.route = route,
                  .seed = simulator.seed(),
                  .frame_rate_hz = camera.frame_rate_hz,
                  .width_px = camera.model.intrinsics().width_px,
                  .height_px = camera.model.intrinsics().height_px,
                  .variants = std::move(variants),
                  .frames = {},
                  .odometry = {}};
  while (const auto frame = simulator.next()) {
    const Truth& truth = simulator.truth().at(0);
    run.frames.push_back({.captured = frame->captured,
                          .truth = truth.pose,
                          .in_view = truth.in_view,
                          .visible = truth.visible,
                          .seen = look(*frame)});
    for (const Odometry& said : simulator.take_odometry()) {
      run.odometry.push_back(
          {.at = said.at, .forward = said.v_mps, .sideways = said.side_mps, .yaw_rate = said.w_radps});
    }
  }
  return run;
}

}  // namespace skylight::service::reproduce
