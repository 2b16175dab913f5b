#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>

#include <gmock/gmock.h>
#include <unistd.h>

#include "service/report/report.hpp"

namespace skylight::service::report {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class WriteReport : public testing::Test {
 protected:
  WriteReport() : folder_(fs::temp_directory_path() / ("skylight-report-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    document_.title = "t";
    document_.sections = {
        {"s", "S", 1, {Table{.id = "a", .columns = {{"c"}}}, Plot{.id = "b"}, Gallery{{{.id = "c"}}}}}};
  }
  ~WriteReport() override { fs::remove_all(folder_); }

  std::set<std::string> files() const {
    std::set<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.is_regular_file()) out.insert(fs::relative(entry.path(), folder_).generic_string());
    }
    return out;
  }
  std::string content(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string failure() const {
    try {
      write(document_, folder_);
    } catch (const std::system_error& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
  Document document_;
};

TEST_F(WriteReport, MakesTheFolderAndEveryFile) {
  folder_ /= "deep/below";
  write(document_, folder_);
  EXPECT_THAT(files(), ElementsAre("plots/b.csv", "plots/b.svg", "plots/c.csv", "plots/c.svg", "report.html",
                                   "report.json", "tables/a.csv"));
  EXPECT_EQ(content("report.html"), html(document_));
  EXPECT_EQ(content("tables/a.csv"), "c\n");
  EXPECT_EQ(nlohmann::json::parse(content("report.json")), to_json(document_));
  folder_ = folder_.parent_path().parent_path();
}

TEST_F(WriteReport, ReplacesAnEarlierReportWhole) {
  std::ofstream(folder_ / "report.html") << std::string(1000000, 'x');
  write(document_, folder_);
  EXPECT_EQ(content("report.html"), html(document_));
}

TEST_F(WriteReport, NamesTheFolderThatIsNone) {
  std::ofstream(folder_ / "tables") << "a file";
  EXPECT_THAT(failure(), HasSubstr("cannot write " + (folder_ / "tables").string() + ": "));
}

TEST_F(WriteReport, NamesTheFileAndTheReasonAndLeavesNoDraft) {
  fs::create_directories(folder_ / "plots/b.svg/in-the-way");
  EXPECT_EQ(failure(), "cannot write " + (folder_ / "plots/b.svg").string() + ": Is a directory");
  EXPECT_THAT(files(), ElementsAre("plots/b.csv", "tables/a.csv"));
}

TEST_F(WriteReport, WritesNothingOfADocumentThatIsWrong) {
  document_.sections[0].level = 0;
  EXPECT_THROW(write(document_, folder_), std::invalid_argument);
  EXPECT_TRUE(files().empty());
}

}  // namespace
}  // namespace skylight::service::report
