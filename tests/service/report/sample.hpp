// Documents to look at and to test with.
#pragma once

#include <cstdint>

#include "service/report/document.hpp"

namespace skylight::service::report {

/// A value in [0, 1) for each n: the same on every machine.
double noise(std::uint64_t n);

/// Every kind of part as a report on trackers has it; its figures are made up.
Document sample_document();

/// The same kinds with the worst that data and texts can be.
Document hostile_document();

}  // namespace skylight::service::report
