// From plain structs to one HTML file with its plots inside, to SVG, CSV and JSON. Nothing here reads a
// clock, a locale or a network: the same document gives the same bytes.
//
// All throw std::invalid_argument, naming the part by its id, for what check() refuses.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "service/report/document.hpp"

namespace skylight::service::report {

/// Refuses ids that are no ids or are there twice, columns of unequal length, rows with too few or too many
/// cells, ranges and options that contradict each other. Data are never refused: what cannot be drawn is left
/// out, and the plot says how many points that were.
void check(const Plot& plot);
void check(const Table& table);
void check(const Document& document);

/// A picture by itself, 820 px wide, with its title, for light and dark screens.
std::string svg(const Plot& plot);

/// One page: no scripts, nothing loaded from elsewhere. It is XML as well (XHTML's syntax). Under each table
/// and plot it names the CSV file that write() puts beside it.
std::string html(const Document& document);

/// A line of headings ("group: heading (unit)"), then the rows, with "\n" between lines and RFC 4180's
/// quotes. Numbers have all their digits; NaN is an empty field.
std::string csv(const Table& table);
/// series,x,y,low,high: a line for each point.
std::string csv(const Plot& plot);

/// {title, subtitle, facts: [{name, value}], sections: [{id, title, level, blocks: [{kind, ...}]}]}. Numbers
/// are numbers; NaN and infinity are null.
nlohmann::json to_json(const Document& document);

/// Writes report.html, report.json, tables/<id>.csv, plots/<id>.csv and plots/<id>.svg; makes the folder
/// where it is missing. Each file appears whole or not at all (written beside, then renamed), report.html
/// last. Throws std::system_error that names the file and the reason.
void write(const Document& document, const std::filesystem::path& folder);

}  // namespace skylight::service::report
