// A plot as SVG.
#pragma once

#include <string>

#include "service/report/document.hpp"
#include "service/report/frame.hpp"

namespace skylight::service::report {

/// For a page (canvas.standalone false: the page brings kPlotStyle and says the title) or as a file. The plot
/// passed check().
std::string draw(const Plot& plot, const Canvas& canvas);

}  // namespace skylight::service::report
