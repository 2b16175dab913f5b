// Instants as decimal Unix seconds, exact to the nanosecond in both directions (a double is not: 0.2 us).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tracker/types.hpp"

namespace skylight::service {

/// "1700000000.008333333"; six digits after the point where these are exact.
std::string time_text(Time time);

/// Digits, and after a point up to nine more; none where the text is anything else.
std::optional<Time> time_from_text(std::string_view text);

}  // namespace skylight::service
