// The filters by their settings.
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "tracker/filter/motion_config.hpp"
#include "tracker/filter/window.hpp"

namespace skylight {

/// Which filter, and how it is set: the motion filter unless asked otherwise.
using FilterSpec = std::variant<MotionFilterConfig, WindowFilterConfig>;

/// Empty, or what is wrong, naming field, value and range.
std::string check(const FilterSpec& spec);

/// Throws std::invalid_argument with check()'s message.
std::unique_ptr<Filter> make_filter(const FilterSpec& spec);

}  // namespace skylight
