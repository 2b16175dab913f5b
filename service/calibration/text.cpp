#include "service/calibration/text.hpp"

#include <cstdio>

namespace skylight::calibration {

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace skylight::calibration
