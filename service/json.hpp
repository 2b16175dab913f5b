// JSON as this folder writes it.
#pragma once

#include <nlohmann/json.hpp>

namespace skylight::service {

/// Keys stay in the order in which they are written: people read this.
using Json = nlohmann::ordered_json;

}  // namespace skylight::service
