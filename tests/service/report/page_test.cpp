#include <functional>

#include <gmock/gmock.h>

#include "service/report/report.hpp"

namespace skylight::service::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Document with(std::vector<Block> blocks) {
  return {.title = "t", .sections = {{"one", "One", 1, std::move(blocks)}}};
}

TEST(Page, NumbersSectionsAndListsThemInTheContents) {
  const std::string page = html({.title = "t",
                                 .sections = {{"a", "First", 1, {}},
                                              {"b", "Part", 2, {}},
                                              {"c", "Part again", 2, {}},
                                              {"d", "Second", 1, {}},
                                              {"e", "Part of it", 2, {}}}});
  EXPECT_THAT(page, HasSubstr("<span class=\"number\">1.2</span><a href=\"#c\">Part again</a>"));
  EXPECT_THAT(page, HasSubstr("<h3 id=\"e\"><span class=\"number\">2.1</span>Part of it</h3>"));
}

TEST(Page, PutsGroupsAboveTheirColumns) {
  const Table table{
      .id = "t",
      .columns = {{"route"}, {"mean", "m", "before"}, {"minimum", "m", "before"}, {"mean", "m", "after"}}};
  const std::string page = html(with({table}));
  EXPECT_THAT(page, HasSubstr("<th scope=\"colgroup\" class=\"group\" colspan=\"2\">before</th>"
                              "<th scope=\"colgroup\" class=\"group\" colspan=\"1\">after</th>"));
  EXPECT_THAT(page, HasSubstr("rowspan=\"2\">route</th>"));
}

TEST(Page, TellsGoodFromBadWithoutColours) {
  const Table table{
      .id = "t",
      .columns = {{"a"}, {"b"}},
      .rows = {{{text("x"), number(1.0, 1, Emphasis::good)}}, {{text("y"), number(2.0, 1, Emphasis::bad)}}}};
  const std::string page = html(with({table}));
  EXPECT_THAT(page, HasSubstr("aria-label=\"good\">✓</span>1.0</td>"));
  EXPECT_THAT(page, HasSubstr("aria-label=\"bad\">✗</span>2.0</td>"));
}

TEST(Page, AlignsNumbersToTheRightAndWordsToTheLeft) {
  const Table table{.id = "t",
                    .columns = {{"a"}, {"b"}, {"c", "", "", Align::centre}},
                    .rows = {{{text("x"), number(12.5, 1), text("y")}}}};
  const std::string page = html(with({table}));
  EXPECT_THAT(
      page,
      HasSubstr(
          "<th scope=\"row\" class=\"left\">x</th><td class=\"right\">12.5</td><td class=\"centre\">y</td>"));
}

TEST(Page, EscapesEveryTextAndSetsCodeApart) {
  const std::string page =
      html(with({Paragraph{"a < b & `c > d` ` e"}, List{{"<li>"}}, Preformatted{"</pre>"}}));
  EXPECT_THAT(page, HasSubstr("<p>a &lt; b &amp; <code>c &gt; d</code> ` e</p>"));
  EXPECT_THAT(page, HasSubstr("<li>&lt;li&gt;</li>"));
  EXPECT_THAT(page, HasSubstr("&lt;/pre&gt;</pre>"));
}

TEST(Page, LoadsNothingAndRunsNothing) {
  const Plot plot{.id = "p", .series = {{.x = {0, 1}, .y = {0, 1}}}};
  const std::string page = html(with({plot, Gallery{{{.id = "q"}}}}));
  EXPECT_THAT(page, HasSubstr("default-src 'none'; style-src 'unsafe-inline'"));
  for (const char* word : {"<script", "src=", "@import", "href=\"http", "<link"})
    EXPECT_THAT(page, Not(HasSubstr(word)));
}

struct Mistake {
  std::function<void(Document&)> make;
  std::string message;
};

TEST(Check, NamesThePartAndWhatIsWrongWithIt) {
  const auto plot = [](Document& d) -> Plot& { return std::get<Plot>(d.sections[0].blocks[0]); };
  const auto table = [](Document& d) -> Table& { return std::get<Table>(d.sections[0].blocks[1]); };
  const std::vector<Mistake> mistakes{
      {[&](Document& d) { plot(d).id = "../up"; }, "plot \"../up\": an id is"},
      {[&](Document& d) { plot(d).id = ""; }, "plot \"\": an id is"},
      {[&](Document& d) { plot(d).id = "Fig"; }, "plot \"Fig\": an id is"},
      {[&](Document& d) { plot(d).id = "t"; }, "table \"t\": the id is there twice"},
      {[&](Document& d) { d.sections.push_back(d.sections[0]); }, "section \"one\": the id is there twice"},
      {[&](Document& d) { d.sections[0].level = 4; }, "section \"one\": level 4, allowed are 1 to 3"},
      {[&](Document& d) { plot(d).series[0].y.pop_back(); },
       "plot \"p\", series \"s\": 2 values of x, 1 of y"},
      {[&](Document& d) {
         plot(d).series[0].low = {1.0, 2.0};
       },
       "series \"s\": 2 values of x, 2 of low, 0 of high"},
      {[&](Document& d) { plot(d).series[0].style = Style::band; },
       "series \"s\": 2 values of x, 0 of low, 0 of high"},
      {[&](Document& d) { plot(d).x_range = {.low = 2.0, .high = 2.0}; },
       "plot \"p\", x: the range's low end must be below"},
      {[&](Document& d) { plot(d).y_range.low = 1e200; }, "plot \"p\", y: an end of a range must be finite"},
      {[&](Document& d) {
         plot(d).log_y = true;
         plot(d).y_range.low = 0.0;
       },
       "plot \"p\", y: the range of a log axis must be above zero"},
      {[&](Document& d) { plot(d).log_y = plot(d).equal_axes = true; }, "plot \"p\": equal axes"},
      {[&](Document& d) {
         plot(d).log_x = true;
         plot(d).x_names = {"a"};
       },
       "plot \"p\": names"},
      {[&](Document& d) { table(d).columns.clear(); }, "table \"t\": it has no columns"},
      {[&](Document& d) { table(d).rows[0].cells.pop_back(); }, "table \"t\", row 1: 1 cells for 2 columns"}};
  const Document good =
      with({Plot{.id = "p", .series = {{.name = "s", .x = {1, 2}, .y = {1, 2}}}},
            Table{.id = "t", .columns = {{"a"}, {"b"}}, .rows = {{{text("x"), text("y")}}}}});
  EXPECT_NO_THROW(check(good));
  for (const Mistake& mistake : mistakes) {
    Document bad = good;
    mistake.make(bad);
    try {
      html(bad);
      ADD_FAILURE() << "accepted: " << mistake.message;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(mistake.message));
    }
  }
}

}  // namespace
}  // namespace skylight::service::report
