// What is printed is read back: rendered by poppler's pdftoppm, tags found, distances measured.
#include "service/tag_sheets.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>
#include <unistd.h>

#include "tracker/detect/apriltag.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kDpi = 150.0;
constexpr double kPxPerMm = kDpi / 25.4;
constexpr double kExactPx = 0.12 * kPxPerMm;  // 0.12 mm

class TagSheetsFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("skylight_tags_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  // The sheets as pictures; none where there is no pdftoppm.
  std::vector<cv::Mat> rendered(const std::string& pdf) const {
    const std::string command = "pdftoppm -gray -png -r 150 " + pdf + " " + file("page") + " 2>/dev/null";
    std::vector<cv::Mat> pages;
    if (std::system(command.c_str()) != 0) return pages;
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (entry.path().extension() == ".png") files.insert(entry.path());
    }
    for (const fs::path& page : files) pages.push_back(cv::imread(page.string(), cv::IMREAD_GRAYSCALE));
    return pages;
  }

  fs::path folder_;
};

std::string refusal(const std::function<void()>& call) {
  try {
    call();
    return "accepted";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST_F(TagSheetsFile, ShowEveryTagInItsSizeAtItsPlace) {
  for (const std::string family : {"36h11", "16h5", "Standard41h12"}) {
    TagSheets sheets{
        .family = family, .ids = {11, 0, 5, 7, 3, 2, 1}, .size_m = 0.05, .out = file(family + ".pdf")};
    const SheetLayout where = layout(sheets);
    ASSERT_EQ(write_tag_sheets(sheets), (7 + where.per_sheet() - 1) / where.per_sheet());
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (entry.path().extension() == ".png") fs::remove(entry.path());
    }
    const auto pages = rendered(sheets.out);
    if (pages.empty()) GTEST_SKIP() << "there is no pdftoppm (poppler-utils)";
    const TagFinder finder({family});
    const double rim_mm = 0.5 * (where.whole_mm - 50.0);
    std::size_t next = 0;
    for (const cv::Mat& page : pages) {
      EXPECT_NEAR(page.cols, 210.0 * kPxPerMm, 1.0);
      EXPECT_NEAR(page.rows, 297.0 * kPxPerMm, 1.0);
      const auto found = finder.find(page, {cv::Rect({}, page.size()), 100.0});
      const std::size_t here = std::min<std::size_t>(where.per_sheet(), sheets.ids.size() - next);
      ASSERT_EQ(found.size(), here) << family;
      for (std::size_t i = 0; i < here; ++i) {
        const auto tag = std::find_if(found.begin(), found.end(),
                                      [&](const FoundTag& each) { return each.id == sheets.ids[next + i]; });
        ASSERT_NE(tag, found.end()) << family << " " << sheets.ids[next + i];
        const auto [x, y] = place_of(sheets, where, static_cast<int>(i));
        // Sheets begin at the left edge of their first pixel.
        const Pixel corner = kPxPerMm * Pixel(x + rim_mm, y + rim_mm) - Pixel(0.5, 0.5);
        EXPECT_LT((tag->corners_px[0] - corner).norm(), kExactPx) << family << " " << tag->id;
        EXPECT_NEAR((tag->corners_px[1] - tag->corners_px[0]).norm(), 50.0 * kPxPerMm, kExactPx) << family;
        EXPECT_NEAR((tag->corners_px[3] - tag->corners_px[0]).norm(), 50.0 * kPxPerMm, kExactPx) << family;
      }
      next += here;
    }
    EXPECT_EQ(next, sheets.ids.size());
  }
}

TEST_F(TagSheetsFile, HaveABarOf100MillimetresAndMarksOutsideTheRim) {
  const TagSheets sheets{.ids = {4}, .size_m = 0.1, .out = file("one.pdf")};
  const SheetLayout where = layout(sheets);
  ASSERT_EQ(write_tag_sheets(sheets), 1);
  const auto pages = rendered(sheets.out);
  if (pages.empty()) GTEST_SKIP() << "there is no pdftoppm (poppler-utils)";
  const cv::Mat& page = pages[0];
  int longest = 0;
  for (int row = static_cast<int>(270 * kPxPerMm); row < page.rows; ++row) {
    int first = page.cols;
    int last = -1;
    for (int column = 0; column < static_cast<int>(113 * kPxPerMm); ++column) {
      if (page.at<std::uint8_t>(row, column) > 160) continue;
      first = std::min(first, column);
      last = std::max(last, column);
    }
    longest = std::max(longest, last - first + 1);
  }
  EXPECT_NEAR(longest, 100.0 * kPxPerMm, 3.0);
  // Between the rim and the tag nothing is printed, beyond the rim the marks are.
  const auto [x, y] = place_of(sheets, where, 0);
  const auto dark_beside = [&, x = x, y = y](double from_mm, double to_mm) {
    const cv::Rect strip(static_cast<int>((x + from_mm) * kPxPerMm), static_cast<int>((y - 1) * kPxPerMm),
                         static_cast<int>((to_mm - from_mm) * kPxPerMm), static_cast<int>(2 * kPxPerMm));
    double least = 255.0;
    cv::minMaxLoc(page(strip), &least);
    return least < 200.0;
  };
  EXPECT_TRUE(dark_beside(-4.5, -1.5));
  EXPECT_FALSE(dark_beside(1.0, where.whole_mm - 1.0));
}

TEST_F(TagSheetsFile, AreSvgWhereTheNameSaysSo) {
  TagSheets sheets{.ids = {0, 1}, .size_m = 0.06, .out = file("two.svg")};
  EXPECT_EQ(write_tag_sheets(sheets), 1);
  std::ifstream in(sheets.out);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  EXPECT_THAT(text, HasSubstr("<svg"));
  for (int id = 2; id < 30; ++id) sheets.ids.push_back(id);
  EXPECT_THAT(refusal([&] { write_tag_sheets(sheets); }), HasSubstr("write a .pdf"));
}

TEST(TagSheets, FitTheirPaper) {
  for (const char* paper : {"A4", "Letter"}) {
    for (const double size : {0.005, 0.03, 0.05, 0.08, 0.12, 0.14}) {
      const TagSheets sheets{.size_m = size, .paper = parse_paper(paper)};
      const SheetLayout where = layout(sheets);
      ASSERT_GE(where.per_sheet(), 1);
      for (const int i : {0, where.per_sheet() - 1}) {
        const auto [x, y] = place_of(sheets, where, i);
        EXPECT_GE(x, 14.9);
        EXPECT_GE(y, 14.9);
        EXPECT_LE(x + where.whole_mm, sheets.paper.width_mm - 14.9);
        EXPECT_LE(y + where.whole_mm, sheets.paper.height_mm - 28.9);
      }
    }
  }
}

TEST(TagSheets, ThatCannotBeAreRefusedNamingWhatCan) {
  EXPECT_EQ(refusal([] { layout({.size_m = 0.2}); }),
            "--size is 0.2, allowed 0.005 to 0.144 m for 36h11 on A4");
  EXPECT_THAT(refusal([] { layout({.size_m = 0.001}); }), HasSubstr("allowed 0.005 to"));
  EXPECT_THAT(refusal([] { layout({.family = "36h12"}); }), HasSubstr("allowed: 36h11"));
  EXPECT_EQ(refusal([] {
              write_tag_sheets({.ids = {586, 587}, .out = "a.pdf"});
            }),
            "--ids: id is 587, allowed 0 to 586 in the family 36h11");
  EXPECT_THAT(refusal([] { write_tag_sheets({.ids = {1}, .out = "a.doc"}); }), HasSubstr(".pdf or .svg"));
  EXPECT_THAT(refusal([] { parse_paper("A5"); }), HasSubstr("allowed: A4, Letter"));
  EXPECT_THROW(write_tag_sheets({.ids = {1}, .out = "/nowhere/a.pdf"}), std::runtime_error);
}

TEST(TagSheets, IdsAreNumbersAndRanges) {
  EXPECT_EQ(parse_ids("0-3"), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(parse_ids("7,3-4,9"), (std::vector<int>{7, 3, 4, 9}));
  for (const char* wrong :
       {"", "a", "1-", "-1", "1,,2", "1 2", "3-1", "1,1", "0-99999999", "1.5", "99999999999"})
    EXPECT_THAT(refusal([&] { parse_ids(wrong); }), HasSubstr("--ids is '" + std::string(wrong) + "'"));
}

}  // namespace
}  // namespace skylight::service
