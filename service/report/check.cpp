// What a report refuses: mistakes of the program that fills it, told by the id of the part.
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "service/report/report.hpp"

namespace skylight::service::report {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("report: " + what);
}

void check_id(const std::string& part, const std::string& id) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto allowed = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '_'; };
  if (id.empty() || id.size() > 64 || !letter(id[0]) || !std::all_of(id.begin(), id.end(), allowed)) {
    refuse(part + " \"" + id +
           "\": an id is 1 to 64 lower-case letters, digits, \"-\" and \"_\" and begins with a letter");
  }
}

void check_series(const std::string& part, const Series& series) {
  const std::string name = part + ", series \"" + series.name + "\": ";
  const std::size_t points = series.x.size();
  const auto count = [](const std::vector<double>& column) { return std::to_string(column.size()); };
  const bool band = series.style == Style::band;
  if (series.y.size() != points && !(band && series.y.empty())) {
    refuse(name + count(series.x) + " values of x, " + count(series.y) + " of y");
  }
  for (const auto* column : {&series.low, &series.high}) {
    if (column->size() == points || (column->empty() && !band && series.low.size() == series.high.size()))
      continue;
    refuse(name + count(series.x) + " values of x, " + count(series.low) + " of low, " + count(series.high) +
           " of high");
  }
}

void check_range(const std::string& part, const Range& range, bool log) {
  for (const auto& end : {range.low, range.high}) {
    if (!end) continue;
    if (!std::isfinite(*end) || std::abs(*end) > 1e100)
      refuse(part + ": an end of a range must be finite, at most 1e100");
    if (log && *end < 1e-100) refuse(part + ": the range of a log axis must be above zero");
  }
  if (!range.low || !range.high) return;
  if (*range.high - *range.low <= 1e-9 * std::max(std::abs(*range.low), std::abs(*range.high))) {
    refuse(part + ": the range's low end must be below its high end");
  }
}

void take_id(const std::string& part, const std::string& id, std::set<std::string>& ids) {
  check_id(part, id);
  if (!ids.insert(id).second) refuse(part + " \"" + id + "\": the id is there twice");
}

void check_block(const Block& block, std::set<std::string>& ids) {
  if (const auto* table = std::get_if<Table>(&block)) {
    check(*table);
    take_id("table", table->id, ids);
  } else if (const auto* plot = std::get_if<Plot>(&block)) {
    check(*plot);
    take_id("plot", plot->id, ids);
  } else if (const auto* gallery = std::get_if<Gallery>(&block)) {
    for (const Plot& one : gallery->plots) {
      check(one);
      take_id("plot", one.id, ids);
    }
  }
}

}  // namespace

void check(const Plot& plot) {
  check_id("plot", plot.id);
  const std::string part = "plot \"" + plot.id + "\"";
  for (const Series& series : plot.series) check_series(part, series);
  check_range(part + ", x", plot.x_range, plot.log_x);
  check_range(part + ", y", plot.y_range, plot.log_y);
  if (plot.equal_axes && (plot.log_x || plot.log_y || !plot.x_names.empty())) {
    refuse(part + ": equal axes go with neither log axes nor names");
  }
  if (plot.log_x && !plot.x_names.empty()) refuse(part + ": names do not go with a log axis");
}

void check(const Table& table) {
  check_id("table", table.id);
  if (table.columns.empty()) refuse("table \"" + table.id + "\": it has no columns");
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (table.rows[i].cells.size() == table.columns.size()) continue;
    refuse("table \"" + table.id + "\", row " + std::to_string(i + 1) + ": " +
           std::to_string(table.rows[i].cells.size()) + " cells for " + std::to_string(table.columns.size()) +
           " columns");
  }
}

void check(const Document& document) {
  std::set<std::string> ids;
  for (const Section& section : document.sections) {
    take_id("section", section.id, ids);
    if (section.level < 1 || section.level > 3) {
      refuse("section \"" + section.id + "\": level " + std::to_string(section.level) +
             ", allowed are 1 to 3");
    }
    for (const Block& block : section.blocks) check_block(block, ids);
  }
}

}  // namespace skylight::service::report
