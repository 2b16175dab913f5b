#include <algorithm>
#include <array>
#include <cmath>

#include "service/report/draw.hpp"
#include "service/report/report.hpp"
#include "service/report/style.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

constexpr double kPageWidthPx = 820.0;
constexpr double kPhoneWidthPx = 360.0;
constexpr double kGalleryWidthPx = 280.0;

std::string element(const std::string& tag, const std::string& classes, const std::string& content) {
  return "<" + tag + (classes.empty() ? "" : " class=\"" + classes + "\"") + ">" + content + "</" +
         tag.substr(0, tag.find(' ')) + ">";
}

// Escaped, with `code` where a pair of backticks stands.
std::string prose(const std::string& text) {
  std::string out;
  std::size_t begin = 0;
  while (true) {
    const std::size_t open = text.find('`', begin);
    const std::size_t close = open == std::string::npos ? open : text.find('`', open + 1);
    if (close == std::string::npos) return out + escape(std::string_view(text).substr(begin));
    out += escape(std::string_view(text).substr(begin, open - begin)) +
           element("code", "", escape(std::string_view(text).substr(open + 1, close - open - 1)));
    begin = close + 1;
  }
}

std::string class_of(Emphasis emphasis) {
  switch (emphasis) {
    case Emphasis::good:
      return "good";
    case Emphasis::bad:
      return "bad";
    case Emphasis::paper:
      return "paper";
    case Emphasis::none:
      break;
  }
  return "";
}

std::string mark_of(Emphasis emphasis) {
  if (emphasis == Emphasis::good) return "<span class=\"mark\" role=\"img\" aria-label=\"good\">✓</span>";
  if (emphasis == Emphasis::bad) return "<span class=\"mark\" role=\"img\" aria-label=\"bad\">✗</span>";
  return "";
}

class Page {
 public:
  explicit Page(const Document& document) : document_(document) {}

  std::string write() {
    const std::string title = escape(document_.title);
    std::string body;
    for (const Section& section : document_.sections) body += write_section(section);
    return "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n"
           "<meta charset=\"utf-8\"/>\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
           "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
           "'unsafe-inline'\"/>\n"
           "<title>" +
           title + "</title>\n<style>" + std::string(kPageStyle) + std::string(kPlotStyle) +
           "</style>\n</head>\n<body>\n<header>\n<h1>" + title + "</h1>\n" + write_head() + "</header>\n" +
           contents() + "<main>\n" + body + "</main>\n</body>\n</html>\n";
  }

 private:
  std::string write_head() const {
    std::string out;
    if (!document_.subtitle.empty()) out += "<p class=\"subtitle\">" + prose(document_.subtitle) + "</p>\n";
    if (document_.facts.empty()) return out;
    out += "<dl class=\"facts\">\n";
    for (const Fact& fact : document_.facts) {
      out += "<dt>" + escape(fact.name) + "</dt><dd>" + prose(fact.value) + "</dd>\n";
    }
    return out + "</dl>\n";
  }

  // 1, 1.1, 1.1.1 as the sections come.
  std::string next_number(int level) {
    const auto index = static_cast<std::size_t>(level - 1);
    ++counts_.at(index);
    std::fill(counts_.begin() + level, counts_.end(), 0);
    std::string out = std::to_string(counts_[0]);
    for (std::size_t i = 1; i <= index; ++i) out += "." + std::to_string(counts_.at(i));
    return out;
  }

  std::string contents() const {
    if (contents_.empty()) return "";
    return "<nav aria-labelledby=\"Contents\">\n<h2 id=\"Contents\">Contents</h2>\n<ul>\n" + contents_ +
           "</ul>\n</nav>\n";
  }

  std::string write_section(const Section& section) {
    const std::string number = element("span", "number", next_number(section.level));
    const std::string title = escape(section.title);
    contents_ += "<li class=\"level-" + std::to_string(section.level) + "\">" + number + "<a href=\"#" +
                 section.id + "\">" + title + "</a></li>\n";
    const std::string tag = "h" + std::to_string(section.level + 1);
    std::string out = "<section aria-labelledby=\"" + section.id + "\">\n<" + tag + " id=\"" + section.id +
                      "\">" + number + title + "</" + tag + ">\n";
    for (const Block& block : section.blocks) {
      out += std::visit([this](const auto& part) { return this->write_block(part); }, block);
    }
    return out + "</section>\n";
  }

  static std::string write_block(const Paragraph& paragraph) {
    const std::string look = class_of(paragraph.emphasis);
    return element("p", look.empty() ? "" : "aside " + look,
                   mark_of(paragraph.emphasis) + prose(paragraph.text)) +
           "\n";
  }

  static std::string write_block(const List& list) {
    if (list.items.empty()) return "";
    std::string items;
    for (const std::string& item : list.items) items += element("li", "", prose(item)) + "\n";
    return element(list.numbered ? "ol" : "ul", "", "\n" + items) + "\n";
  }

  static std::string write_block(const Preformatted& block) {
    return "<pre tabindex=\"0\">" + escape(block.text) + "</pre>\n";
  }

  std::string write_block(const Plot& plot) {
    return figure(plot, draw_inline(plot, kPageWidthPx, ".wide", "wide") +
                            draw_inline(plot, kPhoneWidthPx, ".narrow", "narrow"));
  }

  std::string write_block(const Gallery& gallery) {
    if (gallery.plots.empty()) return "";
    std::string out;
    for (const Plot& plot : gallery.plots)
      out += figure(plot, draw_inline(plot, kGalleryWidthPx, ".small", ""));
    return "<div class=\"gallery\">\n" + out + "</div>\n";
  }

  static std::string draw_inline(const Plot& plot, double width_px, const std::string& suffix,
                                 const std::string& classes) {
    return element("div", classes,
                   "\n" + draw(plot, {.width_px = width_px, .standalone = false, .id_suffix = suffix})) +
           "\n";
  }

  std::string figure(const Plot& plot, const std::string& pictures) {
    return "<figure id=\"" + plot.id + "\">\n" + pictures + "<figcaption>" +
           caption("Figure " + std::to_string(++figures_), plot.title, plot.caption,
                   "plots/" + plot.id + ".csv") +
           "</figcaption>\n</figure>\n";
  }

  static std::string caption(const std::string& number, const std::string& title, const std::string& text,
                             const std::string& file) {
    std::string out = "<b>" + number + (title.empty() ? "." : ". " + escape(title) + ".") + "</b>";
    if (!text.empty()) out += " " + prose(text);
    return out + " <a class=\"file\" href=\"" + file + "\">CSV</a>";
  }

  std::string write_block(const Table& table) {
    const std::vector<std::string> aligns = alignments(table);
    std::string out = "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-labelledby=\"" + table.id +
                      ".caption\">\n<table id=\"" + table.id + "\">\n<caption id=\"" + table.id +
                      ".caption\"><span class=\"words\">" +
                      caption("Table " + std::to_string(++tables_), table.title, table.caption,
                              "tables/" + table.id + ".csv") +
                      "</span></caption>\n<thead>\n" + write_headings(table, aligns) + "</thead>\n<tbody>\n";
    for (const Row& row : table.rows) {
      out += row.rule_above ? "<tr class=\"rule\">" : "<tr>";
      for (std::size_t i = 0; i < row.cells.size(); ++i) out += write_cell(row.cells[i], aligns[i], i == 0);
      out += "</tr>\n";
    }
    return out + "</tbody>\n</table>\n</div>\n";
  }

  static std::vector<std::string> alignments(const Table& table) {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      const Align align = table.columns[i].align;
      const bool numbers = std::any_of(table.rows.begin(), table.rows.end(),
                                       [i](const Row& row) { return row.cells[i].number.has_value(); });
      const bool right = align == Align::right || (align == Align::automatic && numbers);
      out.emplace_back(align == Align::centre ? "centre" : right ? "right" : "left");
    }
    return out;
  }

  // Groups above their columns; a column without a group has one heading, two rows high.
  static std::string write_headings(const Table& table, const std::vector<std::string>& aligns) {
    const std::vector<Column>& columns = table.columns;
    const bool grouped =
        std::any_of(columns.begin(), columns.end(), [](const Column& c) { return !c.group.empty(); });
    std::string upper;
    std::string lower;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const bool alone = columns[i].group.empty();
      std::string words = prose(columns[i].heading);
      if (!columns[i].unit.empty())
        words += " " + element("span", "unit", "(" + escape(columns[i].unit) + ")");
      const std::string rows = grouped && alone ? " rowspan=\"2\"" : "";
      const std::string heading =
          "<th scope=\"col\" class=\"" + aligns[i] + "\"" + rows + ">" + words + "</th>";
      (grouped && alone ? upper : lower) += heading;
      if (alone || (i > 0 && columns[i - 1].group == columns[i].group)) continue;
      std::size_t end = i;
      while (end < columns.size() && columns[end].group == columns[i].group) ++end;
      upper += "<th scope=\"colgroup\" class=\"group\" colspan=\"" + std::to_string(end - i) + "\">" +
               prose(columns[i].group) + "</th>";
    }
    return (upper.empty() ? "" : "<tr>" + upper + "</tr>\n") +
           (lower.empty() ? "" : "<tr>" + lower + "</tr>\n");
  }

  static std::string write_cell(const Cell& cell, const std::string& align, bool is_heading) {
    constexpr std::size_t kLongText = 40;
    std::string classes = align;
    if (!cell.number && cell.text.size() > kLongText) classes += " wrap";
    if (const std::string look = class_of(cell.emphasis); !look.empty()) classes += " " + look;
    const std::string words = cell.number ? rounded(*cell.number, cell.digits) : prose(cell.text);
    return "<" + std::string(is_heading ? "th scope=\"row\"" : "td") + " class=\"" + classes + "\">" +
           mark_of(cell.emphasis) + words + (is_heading ? "</th>" : "</td>");
  }

  const Document& document_;
  std::string contents_;
  std::array<int, 3> counts_{};
  int figures_ = 0;
  int tables_ = 0;
};

}  // namespace

std::string html(const Document& document) {
  check(document);
  return Page(document).write();
}

}  // namespace skylight::service::report
