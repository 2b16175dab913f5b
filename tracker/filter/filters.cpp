#include "tracker/filter/filters.hpp"

#include "tracker/filter/motion.hpp"

namespace skylight {

std::string check(const FilterSpec& spec) {
  return std::visit([](const auto& config) { return check(config); }, spec);
}

std::unique_ptr<Filter> make_filter(const FilterSpec& spec) {
  if (const auto* window = std::get_if<WindowFilterConfig>(&spec))
    return std::make_unique<WindowFilter>(*window);
  return std::make_unique<MotionFilter>(std::get<MotionFilterConfig>(spec));
}

}  // namespace skylight
