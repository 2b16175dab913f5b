#include "service/report/report.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

// RFC 4180, section 2: quotes around what has a comma, a quote or a line's end; blanks at the ends are kept
// that way too.
std::string field(const std::string& raw) {
  const std::string text = clean(raw);
  const bool blank_ends = !text.empty() && (text.front() == ' ' || text.back() == ' ');
  if (!blank_ends && text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + "\"";
}

std::string heading(const Column& column) {
  return (column.group.empty() ? "" : column.group + ": ") + column.heading +
         (column.unit.empty() ? "" : " (" + column.unit + ")");
}

std::string at(const std::vector<double>& column, std::size_t i) {
  return i < column.size() ? exact(column[i]) : std::string();
}

std::string x_text(const Plot& plot, double x) {
  if (x >= 0.0 && x < static_cast<double>(plot.x_names.size())) {
    const auto i = static_cast<std::size_t>(x);
    if (static_cast<double>(i) == x) return field(plot.x_names[i]);
  }
  return exact(x);
}

}  // namespace

std::string csv(const Table& table) {
  check(table);
  std::string out;
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    out += (i > 0 ? "," : "") + field(heading(table.columns[i]));
  out += "\n";
  for (const Row& row : table.rows) {
    std::string line;
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const Cell& cell = row.cells[i];
      line += (i > 0 ? "," : "") + (cell.number ? exact(*cell.number) : field(cell.text));
    }
    // A single empty field would be an empty line, which readers take for no row.
    out += (line.empty() ? "\"\"" : line) + "\n";
  }
  return out;
}

std::string csv(const Plot& plot) {
  check(plot);
  std::string out = "series,x,y,low,high\n";
  for (const Series& series : plot.series) {
    const std::string name = field(series.name);
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      out += name + "," + x_text(plot, series.x[i]) + "," + at(series.y, i) + "," + at(series.low, i) + "," +
             at(series.high, i) + "\n";
    }
  }
  return out;
}

}  // namespace skylight::service::report
