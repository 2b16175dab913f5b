#include <cmath>

#include "service/report/report.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

using Json = nlohmann::json;

Json value(double number) {
  return std::isfinite(number) ? Json(number) : Json(nullptr);
}

Json values(const std::vector<double>& numbers) {
  Json out = Json::array();
  for (const double number : numbers) out.push_back(value(number));
  return out;
}

Json texts(const std::vector<std::string>& words) {
  Json out = Json::array();
  for (const std::string& word : words) out.push_back(clean(word));
  return out;
}

const char* style_name(Style style) {
  switch (style) {
    case Style::line:
      return "line";
    case Style::dots:
      return "dots";
    case Style::line_and_dots:
      return "line_and_dots";
    case Style::dashed:
      return "dashed";
    case Style::band:
      return "band";
    case Style::bars:
      break;
  }
  return "bars";
}

Json series_json(const Series& series) {
  Json out{{"name", clean(series.name)},
           {"style", style_name(series.style)},
           {"x", values(series.x)},
           {"y", values(series.y)}};
  if (!series.low.empty()) {
    out["low"] = values(series.low);
    out["high"] = values(series.high);
  }
  return out;
}

Json markers_json(const std::vector<Marker>& markers) {
  Json out = Json::array();
  for (const Marker& marker : markers)
    out.push_back({{"at", value(marker.at)}, {"label", clean(marker.label)}});
  return out;
}

Json block_json(const Plot& plot) {
  Json series = Json::array();
  for (const Series& one : plot.series) series.push_back(series_json(one));
  Json out{{"kind", "plot"},
           {"id", plot.id},
           {"title", clean(plot.title)},
           {"caption", clean(plot.caption)},
           {"x_label", clean(plot.x_label)},
           {"y_label", clean(plot.y_label)},
           {"series", series},
           {"vertical", markers_json(plot.vertical)},
           {"horizontal", markers_json(plot.horizontal)}};
  if (!plot.x_names.empty()) out["x_names"] = texts(plot.x_names);
  return out;
}

Json block_json(const Gallery& gallery) {
  Json plots = Json::array();
  for (const Plot& plot : gallery.plots) plots.push_back(block_json(plot));
  return {{"kind", "gallery"}, {"plots", plots}};
}

Json block_json(const Table& table) {
  Json columns = Json::array();
  for (const Column& column : table.columns) {
    columns.push_back(
        {{"heading", clean(column.heading)}, {"unit", clean(column.unit)}, {"group", clean(column.group)}});
  }
  Json rows = Json::array();
  for (const Row& row : table.rows) {
    Json cells = Json::array();
    for (const Cell& cell : row.cells)
      cells.push_back(cell.number ? value(*cell.number) : Json(clean(cell.text)));
    rows.push_back(cells);
  }
  return {{"kind", "table"},
          {"id", table.id},
          {"title", clean(table.title)},
          {"caption", clean(table.caption)},
          {"columns", columns},
          {"rows", rows}};
}

Json block_json(const Paragraph& paragraph) {
  return {{"kind", "paragraph"}, {"text", clean(paragraph.text)}};
}
Json block_json(const Preformatted& block) {
  return {{"kind", "preformatted"}, {"text", clean(block.text)}};
}
Json block_json(const List& list) {
  return {{"kind", "list"}, {"numbered", list.numbered}, {"items", texts(list.items)}};
}

}  // namespace

nlohmann::json to_json(const Document& document) {
  check(document);
  Json facts = Json::array();
  for (const Fact& fact : document.facts)
    facts.push_back({{"name", clean(fact.name)}, {"value", clean(fact.value)}});
  Json sections = Json::array();
  for (const Section& section : document.sections) {
    Json blocks = Json::array();
    for (const Block& block : section.blocks) {
      blocks.push_back(std::visit([](const auto& part) { return block_json(part); }, block));
    }
    sections.push_back(
        {{"id", section.id}, {"title", clean(section.title)}, {"level", section.level}, {"blocks", blocks}});
  }
  return {{"title", clean(document.title)},
          {"subtitle", clean(document.subtitle)},
          {"facts", facts},
          {"sections", sections}};
}

}  // namespace skylight::service::report
