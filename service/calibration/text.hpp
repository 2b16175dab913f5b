// Numbers as people read them.
#pragma once

#include <string>

namespace skylight::calibration {

/// With so many digits behind the point, in the C locale: 1.50.
std::string fixed(double value, int digits);

}  // namespace skylight::calibration
