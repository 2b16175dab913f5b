#include "service/tag_sheets.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <stdexcept>

#include <cairo-pdf.h>
#include <cairo-svg.h>

#include "tracker/detect/apriltag.hpp"

namespace skylight::service {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;
constexpr double kMarginMm = 10.0;  // of the sheet: what printers leave white
constexpr double kGapMm = 12.0;     // between tags, for marks and words
constexpr double kFooterMm = 14.0;  // for the bar
constexpr double kMarkMm = 4.0;     // length of a cutting mark
constexpr double kMarkGapMm = 1.0;  // from the rim
constexpr double kRulerMm = 100.0;
constexpr double kMostTags = 10000;
constexpr std::array kPapers{Paper{"A4", 210.0, 297.0}, Paper{"Letter", 215.9, 279.4}};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// How many squares of this edge with gaps between them fit into a length.
int fitting(double length_mm, double edge_mm) {
  return static_cast<int>(std::floor((length_mm + kGapMm + 1e-9) / (edge_mm + kGapMm)));
}

double room_across(const Paper& paper) {
  return paper.width_mm - 2.0 * kMarginMm - 2.0 * (kMarkMm + kMarkGapMm);
}
double room_down(const Paper& paper) {
  return paper.height_mm - 2.0 * kMarginMm - kFooterMm - 2.0 * (kMarkMm + kMarkGapMm);
}

using Surface = std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)>;
using Context = std::unique_ptr<cairo_t, void (*)(cairo_t*)>;

Surface open_surface(const TagSheets& sheets) {
  const double width = sheets.paper.width_mm * kPointsPerMm;
  const double height = sheets.paper.height_mm * kPointsPerMm;
  const bool svg = std::filesystem::path(sheets.out).extension() == ".svg";
  cairo_surface_t* surface = svg ? cairo_svg_surface_create(sheets.out.c_str(), width, height)
                                 : cairo_pdf_surface_create(sheets.out.c_str(), width, height);
  return {surface, cairo_surface_destroy};
}

void write_words(cairo_t* cairo, double x_mm, double y_mm, const std::string& words) {
  cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo, 2.6);
  cairo_move_to(cairo, x_mm, y_mm);
  cairo_show_text(cairo, words.c_str());
}

void draw_line(cairo_t* cairo, double x_mm, double y_mm, double to_x_mm, double to_y_mm) {
  cairo_move_to(cairo, x_mm, y_mm);
  cairo_line_to(cairo, to_x_mm, to_y_mm);
  cairo_stroke(cairo);
}

// All black cells as one path: no seams between neighbours.
void draw_cells(cairo_t* cairo, const cv::Mat& cells, double cell_mm) {
  for (int r = 0; r < cells.rows; ++r) {
    for (int begin = 0; begin < cells.cols; ++begin) {
      if (cells.at<std::uint8_t>(r, begin) != 0) continue;
      int end = begin;
      while (end < cells.cols && cells.at<std::uint8_t>(r, end) == 0) ++end;
      cairo_rectangle(cairo, begin * cell_mm, r * cell_mm, (end - begin) * cell_mm, cell_mm);
      begin = end;
    }
  }
  cairo_fill(cairo);
}

void draw_cutting_marks(cairo_t* cairo, double whole_mm) {
  cairo_set_line_width(cairo, 0.1);
  for (const double at : {0.0, whole_mm}) {
    for (const auto& [from, to] : {std::array{-kMarkGapMm - kMarkMm, -kMarkGapMm},
                                   std::array{whole_mm + kMarkGapMm, whole_mm + kMarkGapMm + kMarkMm}}) {
      draw_line(cairo, from, at, to, at);
      draw_line(cairo, at, from, at, to);
    }
  }
}

void draw_tag(cairo_t* cairo, const TagSheets& sheets, const SheetLayout& where, int id) {
  draw_cells(cairo, tag_pattern(sheets.family, id).cells, where.cell_mm);
  draw_cutting_marks(cairo, where.whole_mm);
  write_words(cairo, kMarkGapMm + 0.5, where.whole_mm + kMarkGapMm + 3.0,
              sheets.family + "  id " + std::to_string(id) + "  " + number(1e3 * sheets.size_m) + " mm");
}

void draw_bar(cairo_t* cairo, const Paper& paper) {
  const double left = kMarginMm + 2.0;
  const double y = paper.height_mm - kMarginMm - 3.0;
  cairo_set_line_width(cairo, 0.2);
  draw_line(cairo, left, y, left + kRulerMm, y);
  for (int i = 0; i <= 10; ++i) {
    const double x = left + 0.1 * i * kRulerMm;
    draw_line(cairo, x, y, x, y - (i % 5 == 0 ? 4.0 : 2.0));
  }
  write_words(cairo, left + kRulerMm + 3.0, y, "100 mm: measure it. Print at 100 %, not fitted to the page.");
}

}  // namespace

std::vector<int> parse_ids(std::string_view text) {
  const std::string name = "--ids is '" + std::string(text) + "'";
  std::vector<int> ids;
  std::set<int> seen;
  const auto read = [&](std::string_view word) {
    int value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || value < 0)
      throw std::invalid_argument(name + ", allowed: numbers and ranges such as 0-11 or 3,5,7-9");
    return value;
  };
  for (std::string_view rest = text;;) {
    const std::size_t comma = rest.find(',');
    const std::string_view part = rest.substr(0, comma);
    const std::size_t dash = part.find('-');
    const int first = read(part.substr(0, dash));
    const int last = dash == std::string_view::npos ? first : read(part.substr(dash + 1));
    if (last < first) throw std::invalid_argument(name + ": a range goes up");
    if (last - first >= kMostTags)
      throw std::invalid_argument(name + ": at most " + number(kMostTags) + " tags at a time");
    for (int id = first; id <= last; ++id) {
      if (!seen.insert(id).second)
        throw std::invalid_argument(name + ": " + std::to_string(id) + " is there twice");
      ids.push_back(id);
    }
    if (comma == std::string_view::npos) return ids;
    rest.remove_prefix(comma + 1);
  }
}

Paper parse_paper(std::string_view name) {
  for (const Paper& paper : kPapers) {
    if (paper.name == name) return paper;
  }
  throw std::invalid_argument("--paper is '" + std::string(name) + "', allowed: A4, Letter");
}

SheetLayout layout(const TagSheets& sheets) {
  if (const std::string wrong = check(TagSpec{.family = sheets.family}); !wrong.empty())
    throw std::invalid_argument(wrong);
  const TagPattern pattern = tag_pattern(sheets.family, 0);
  const double whole_per_size = 1.0 * pattern.cells.cols / pattern.border_cells;
  const double most_mm = std::min(room_across(sheets.paper), room_down(sheets.paper));
  const double largest_m = std::floor(most_mm / whole_per_size) / 1e3;
  if (!(sheets.size_m >= 0.005 && sheets.size_m <= largest_m + 1e-9)) {
    throw std::invalid_argument("--size is " + number(sheets.size_m) + ", allowed 0.005 to " +
                                number(largest_m) + " m for " + sheets.family + " on " +
                                std::string(sheets.paper.name));
  }
  SheetLayout where;
  where.cell_mm = 1e3 * sheets.size_m / pattern.border_cells;
  where.whole_mm = where.cell_mm * pattern.cells.cols;
  where.columns = fitting(room_across(sheets.paper), where.whole_mm);
  where.rows = fitting(room_down(sheets.paper), where.whole_mm);
  return where;
}

std::array<double, 2> place_of(const TagSheets& sheets, const SheetLayout& where, int i) {
  const double step = where.whole_mm + kGapMm;
  const double left = 0.5 * (sheets.paper.width_mm - where.columns * step + kGapMm);
  return {left + i % where.columns * step, kMarginMm + kMarkMm + kMarkGapMm + i / where.columns * step};
}

int write_tag_sheets(const TagSheets& sheets) {
  const SheetLayout where = layout(sheets);
  for (const int id : sheets.ids) {
    if (const std::string wrong = check(TagSpec{.family = sheets.family, .id = id}); !wrong.empty())
      throw std::invalid_argument("--ids: " + wrong);
  }
  const std::string kind = std::filesystem::path(sheets.out).extension().string();
  if (kind != ".pdf" && kind != ".svg")
    throw std::invalid_argument("--out is '" + sheets.out + "', its ending must be .pdf or .svg");
  const int count = static_cast<int>(sheets.ids.size());
  const int pages = (count + where.per_sheet() - 1) / where.per_sheet();
  if (kind == ".svg" && pages > 1) {
    throw std::invalid_argument("--out: " + std::to_string(count) + " tags need " + std::to_string(pages) +
                                " sheets, and an .svg holds one of " + std::to_string(where.per_sheet()) +
                                " tags: write a .pdf");
  }
  const Surface surface = open_surface(sheets);
  const Context cairo(cairo_create(surface.get()), cairo_destroy);
  cairo_scale(cairo.get(), kPointsPerMm, kPointsPerMm);
  for (int i = 0; i < count; ++i) {
    const int on_sheet = i % where.per_sheet();
    if (on_sheet == 0) draw_bar(cairo.get(), sheets.paper);
    const auto [x, y] = place_of(sheets, where, on_sheet);
    cairo_save(cairo.get());
    cairo_translate(cairo.get(), x, y);
    draw_tag(cairo.get(), sheets, where, sheets.ids[static_cast<std::size_t>(i)]);
    cairo_restore(cairo.get());
    if (on_sheet + 1 == where.per_sheet() || i + 1 == count) cairo_show_page(cairo.get());
  }
  cairo_surface_finish(surface.get());
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(sheets.out + ": cannot be written: " + cairo_status_to_string(status));
  return pages;
}

}  // namespace skylight::service
