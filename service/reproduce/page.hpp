// What all pages of the report are written with.
#pragma once

#include "service/report/document.hpp"
#include "settings/text.hpp"

namespace skylight::service::reproduce {

using report::Cell;
using report::Colour;
using report::Emphasis;
using report::number;
using report::Paragraph;
using report::Plot;
using report::Row;
using report::Section;
using report::Series;
using report::Style;
using report::Table;
using report::text;
using settings::number_text;

inline constexpr double kMm = 1000.0;                  ///< per metre
inline constexpr double kDegrees = 57.29577951308232;  ///< per radian

}  // namespace skylight::service::reproduce
