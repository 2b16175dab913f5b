#include "service/camera_agreement.hpp"

#include <utility>

namespace skylight::service {

std::vector<AgreementChange> CameraAgreements::see(Time captured, const std::vector<RobotView>& robots) {
  for (Camera& camera : cameras_) camera.now.reset();
  for (const RobotView& robot : robots) {
    if (!robot.filter) continue;
    const std::vector<CameraOpinion> opinions = robot.filter->opinions();
    if (opinions.size() < 2) continue;
    for (const CameraOpinion& opinion : opinions) {
      if (opinion.camera >= cameras_.size()) continue;
      std::optional<CameraAgreement>& now = cameras_[opinion.camera].now;
      if (!now) now.emplace();
      ++now->robots;
      if (opinion.sigmas < now->sigmas) continue;
      now->off_m = opinion.off_m.norm();
      now->sigmas = opinion.sigmas;
      now->refused = opinion.refused > 0;
    }
  }
  std::vector<AgreementChange> changes;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    Camera& camera = cameras_[i];
    if (!camera.now) continue;  // nothing to tell by: it stays as it was
    if (captured - std::exchange(camera.told, captured) > kLasts) camera.since.reset();
    const bool other = camera.disagrees ? camera.now->sigmas < kCalm : camera.now->sigmas > kSigmas;
    if (!other) {
      camera.since.reset();
      continue;
    }
    if (!camera.since) camera.since = captured;
    if (captured - *camera.since < kLasts) continue;
    camera.disagrees = !camera.disagrees;
    camera.since.reset();
    changes.push_back({.camera = i, .disagrees = camera.disagrees, .state = *camera.now});
  }
  return changes;
}

}  // namespace skylight::service
