// Colours and fonts of plots and page.
#pragma once

#include <string_view>

#include "service/report/document.hpp"

namespace skylight::service::report {

struct Ink {
  std::string_view name;   ///< the class of what is drawn with it
  std::string_view light;  ///< on white; on dark grounds kPlotStyle takes over
};
/// `colour` is not automatic.
Ink ink_of(Colour colour);
/// The n-th of the automatic colours, from 0 on; they repeat after six.
Colour automatic_colour(int n);

/// CSS of a plot, by itself or in the page: its colours as variables, for light and dark screens; paper is
/// light.
extern const std::string_view kPlotStyle;
extern const std::string_view kPageStyle;

}  // namespace skylight::service::report
