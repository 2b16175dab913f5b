// A report of the worst: every style over every kind of axis with every kind of bad data, and texts full of
// markup.
#include <limits>
#include <string>

#include "sample.hpp"

namespace skylight::service::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kHuge = std::numeric_limits<double>::max();
constexpr double kTiny = std::numeric_limits<double>::denorm_min();

const std::string kMarkup =
    "</title><script>alert(1)</script> & \"quotes\" 'apostrophes' ]]> <!-- \x01\x7F\xFF\xC0\x80 \xED\xA0\x80 "
    "é\n=1+1";

struct Data {
  std::vector<double> x, y;
};

std::vector<Data> bad_data() {
  std::vector<Data> out{{{}, {}},
                        {{3}, {4}},
                        {{0}, {0}},
                        {{1, 2, 3}, {5, 5, 5}},
                        {{2, 2, 2}, {5, 5, 5}},
                        {{1, 2, 3}, {kNan, kNan, kNan}},
                        {{1, kNan, 3, 4, 5, 6}, {1, 2, kNan, 4, kInf, 6}},
                        {{-kInf, 1, kInf}, {1, 2, 3}},
                        {{-3, -2, -1}, {-1, -10, -100}},
                        {{-1, 0, 1}, {0, 1, 2}},
                        {{-kHuge, 0, kHuge}, {kHuge, 0, -kHuge}},
                        {{1e99, 2e99, 3e99}, {1e-99, 2e-99, 3e-99}},
                        {{kTiny, 2 * kTiny}, {kTiny, kTiny}},
                        {{1e15, 1e15 + 1, 1e15 + 2}, {1e9, 1e9 + 1, 1e9 + 2}},
                        {{1, 1.0000001, 1.0000002}, {1, 1 + 1e-12, 1}},
                        {{1e-80, 1, 1e80}, {1e80, 1, 1e-80}},
                        {{-0.0, 0.0}, {-0.0, 0.0}},
                        {{3, 1, 2, 1, 3}, {1, 3, 2, 1, 3}}};
  Data many;
  for (std::uint64_t i = 0; i < 400; ++i) {
    many.x.push_back(noise(i));
    many.y.push_back(noise(i + 5000) - 0.1);
  }
  out.push_back(std::move(many));
  return out;
}

Plot bad_plot(std::size_t n, const Data& data, Style style, int axes) {
  Series series{.name = kMarkup, .x = data.x, .y = data.y, .style = style};
  const bool spread = style == Style::band || n % 2 == 0;
  for (std::size_t i = 0; spread && i < data.x.size(); ++i) {
    series.low.push_back(i % 4 == 3 ? kNan : data.y[i] - 1.0);
    series.high.push_back(i % 5 == 4 ? kInf : data.y[i] + (i % 3 == 2 ? -2.0 : 1.0));
  }
  Plot plot{.id = "bad-" + std::to_string(n),
            .title = kMarkup,
            .x_label = kMarkup,
            .y_label = kMarkup,
            .series = {series, {.name = "", .x = {1, 2}, .y = {1, 2}}},
            .equal_axes = axes == 4,
            .log_x = axes == 1 || axes == 3,
            .log_y = axes == 2 || axes == 3,
            .vertical = {{1.0, kMarkup}, {kNan, "nowhere"}, {-1e300, "far"}},
            .horizontal = {{2.0, kMarkup}, {kInf, "nowhere"}},
            .caption = kMarkup};
  if (n % 3 == 0) plot.series.pop_back();
  if (n % 4 == 1) plot.y_range = {.low = 0.5, .high = 1.5};
  if (n % 7 == 3) plot.x_range = {.low = 1e-3};
  if (n % 5 == 2) plot.vertical.clear();
  if (n % 5 == 3) plot.horizontal.clear();
  if (axes == 0 && n % 3 == 1) plot.x_names = {kMarkup, "", "three"};
  return plot;
}

}  // namespace

Document hostile_document() {
  Document document{.title = kMarkup, .subtitle = kMarkup + "`" + kMarkup, .facts = {{kMarkup, kMarkup}}};
  Section plots{.id = "plots", .title = kMarkup, .level = 3};
  Gallery gallery;
  std::size_t n = 0;
  for (const Data& data : bad_data()) {
    for (const Style style :
         {Style::line, Style::dots, Style::line_and_dots, Style::dashed, Style::band, Style::bars}) {
      for (int axes = 0; axes < 5; ++axes) gallery.plots.push_back(bad_plot(n++, data, style, axes));
    }
  }
  plots.blocks = {bad_plot(n, bad_data()[6], Style::line, 0), gallery, Gallery{}};
  Table table{.id = "texts",
              .title = kMarkup,
              .columns = {{kMarkup, kMarkup, kMarkup}, {kMarkup, "", kMarkup}, {"=1+1", "m"}},
              .caption = kMarkup};
  table.rows.push_back({{text(kMarkup), text(" blanks "), text("a,b\r\n\"c\"")}});
  table.rows.push_back({{text(""), number(kNan, 3), number(-kInf, 2)}});
  table.rows.push_back({{text("-"), number(kHuge, 99), number(-0.0001, 2)}});
  table.rows.push_back({{text("`"), number(kTiny, -5), number(0.1 + 0.2, 3)}});
  Table bare{.id = "bare", .columns = {{}}, .rows = {{{text("")}}, {{number(kNan, 1)}}}};
  document.sections = {
      plots,
      {"parts",
       kMarkup,
       1,
       {Paragraph{kMarkup}, List{{kMarkup, "`"}}, List{}, Preformatted{kMarkup}, table, bare}}};
  return document;
}

}  // namespace skylight::service::report
