// The worst data and texts through every style and axis; check_report.py reads what comes out as XML.
#include <string>

#include <gtest/gtest.h>

#include "sample.hpp"
#include "service/report/report.hpp"

namespace skylight::service::report {
namespace {

TEST(HostilePlot, IsDrawnWithNumbersWithinItsPicture) {
  const Document document = hostile_document();
  int plots = 0;
  for (const Plot& plot : std::get<Gallery>(document.sections[0].blocks[1]).plots) {
    const std::string picture = svg(plot);
    ++plots;
    for (std::size_t at = picture.find(" d=\""); at != std::string::npos;
         at = picture.find(" d=\"", at + 1)) {
      const std::string path = picture.substr(at + 4, picture.find('"', at + 4) - at - 4);
      ASSERT_EQ(path.find_first_not_of("MLHVhvlmz-0123456789., "), std::string::npos)
          << plot.id << ": " << path;
      ASSERT_EQ(path.find("1000000"), std::string::npos) << plot.id << ": far outside";
    }
  }
  EXPECT_GT(plots, 500);
}

TEST(HostileText, GoesThroughEveryFormat) {
  const Document document = hostile_document();
  EXPECT_EQ(html(document).find("<script"), std::string::npos);
  EXPECT_NO_THROW(to_json(document).dump()) << "dump() refuses what is not UTF-8";
}

}  // namespace
}  // namespace skylight::service::report
