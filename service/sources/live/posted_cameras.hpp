// The cameras to which frames are posted, for whoever only hands them on.
#pragma once

#include <map>
#include <memory>
#include <string>

namespace skylight::service {

class PostedPictures;

/// By the camera's id.
using PostedCameras = std::map<std::string, std::shared_ptr<PostedPictures>>;

}  // namespace skylight::service
