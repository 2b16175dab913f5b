// What a report is made of, as plain structs. Numbers are kept as numbers to the end: the page rounds them,
// CSV and JSON do not. Texts are UTF-8; bytes that are not become U+FFFD. In paragraphs, lists and captions
// `code` stands between backticks.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace skylight::service::report {

enum class Style {
  line,           ///< low and high are a band behind it
  dots,           ///< low and high are whiskers
  line_and_dots,  ///< low and high are whiskers
  dashed,         ///< as line; for the truth, or what else is given
  band,           ///< the area from low to high alone; y is not drawn and may be empty
  bars,  ///< from 0 (from the bottom, on a log axis) to y; low and high are whiskers; several stand side by
         ///< side
};

/// Okabe and Ito's palette, which the colour-blind can tell apart. Automatic ones are taken in this order
/// from blue on.
enum class Colour { automatic, ink, grey, blue, vermillion, green, purple, orange, sky };

/// Points in the order in which a line joins them. A point with NaN or infinity is not drawn and is a gap in
/// a line.
struct Series {
  std::string name;               ///< in the legend; "" keeps it out
  std::vector<double> x, y;       ///< equally long; in the plot's units
  std::vector<double> low, high;  ///< empty, or as long as x; a pair with NaN is left out
  Style style = Style::line;
  Colour colour = Colour::automatic;
};

/// Ends of an axis; what is absent is taken from the data and rounded outwards to a tick.
struct Range {
  std::optional<double> low, high;
};

/// A line across the plot at one value of an axis. Axes reach as far as their markers.
struct Marker {
  double at = 0.0;
  std::string label;  ///< "" for none
};

struct Plot {
  std::string id;  ///< anchor and file name: lower-case letters, digits, "-", "_", beginning with a letter
  std::string title;
  std::string x_label;  ///< with the unit: "time (s)"
  std::string y_label;
  std::vector<Series> series;
  bool equal_axes = false;  ///< one unit is as long across as up: for maps; not with log axes or names
  bool log_x = false;       ///< what is not above zero cannot be shown, and a note says so
  bool log_y = false;
  Range x_range, y_range;
  std::vector<Marker> vertical;      ///< at values of x
  std::vector<Marker> horizontal;    ///< at values of y
  std::vector<std::string> x_names;  ///< of x = 0, 1, 2 ... instead of numbers; not with log_x
  std::string caption;
};

/// Small plots side by side, as many as the page is wide enough for.
struct Gallery {
  std::vector<Plot> plots;
};

/// Told by a mark and a weight as well as by colour.
enum class Emphasis {
  none,
  good,   ///< an aim kept, the better one of two
  bad,    ///< an aim missed
  paper,  ///< somebody else's figure, to compare
};

enum class Align { automatic, left, right, centre };  ///< automatic: right where a cell holds a number

struct Column {
  std::string heading;
  std::string unit;   ///< "" for none
  std::string group;  ///< heading above neighbours that have the same; "" for none
  Align align = Align::automatic;
};

struct Cell {
  std::string text;              ///< used where there is no number
  std::optional<double> number;  ///< NaN is shown as a dash, and is null in JSON
  int digits = 3;                ///< behind the point, 0 to 12, on the page only
  Emphasis emphasis = Emphasis::none;
};

inline Cell text(std::string words, Emphasis emphasis = Emphasis::none) {
  return {.text = std::move(words), .emphasis = emphasis};
}
inline Cell number(double value, int digits, Emphasis emphasis = Emphasis::none) {
  return {.number = value, .digits = digits, .emphasis = emphasis};
}

struct Row {
  std::vector<Cell> cells;  ///< one for each column; the first is the row's heading
  bool rule_above = false;  ///< sets a sum or an average apart
};

struct Table {
  std::string id;  ///< as Plot::id
  std::string title;
  std::vector<Column> columns;
  std::vector<Row> rows;
  std::string caption;
};

struct Paragraph {
  std::string text;
  Emphasis emphasis = Emphasis::none;  ///< good, bad, paper: set apart with a bar at its side
};

struct List {
  std::vector<std::string> items;
  bool numbered = false;
};

struct Preformatted {
  std::string text;
};

using Block = std::variant<Paragraph, Table, Plot, Gallery, List, Preformatted>;

struct Section {
  std::string id;  ///< as Plot::id; sections, tables and plots share one set of ids
  std::string title;
  int level = 1;  ///< 1 to 3
  std::vector<Block> blocks;
};

/// A line of what made the report: command, seeds, version, machine.
struct Fact {
  std::string name;
  std::string value;
};

struct Document {
  std::string title;
  std::string subtitle;
  std::vector<Fact> facts;
  std::vector<Section> sections;
};

}  // namespace skylight::service::report
