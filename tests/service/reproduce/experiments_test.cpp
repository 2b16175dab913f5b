// The whole of `skylight reproduce` on the smallest plan there is.
#include "service/reproduce/experiments.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "service/report/report.hpp"

namespace skylight::service::reproduce {
namespace {

namespace fs = std::filesystem;

Plan smallest_plan() {
  Plan plan = quick_plan();
  plan.paper.setup.px_per_metre = 60.0;  // too coarse to find anything: the tables must stand that too
  plan.paper.routes = {"line-2", "chaotic-1"};
  plan.paper.at_most_s = 2.0;
  plan.resolution = {.px_per_metre = {60.0}, .floors = {"plain"}, .routes = {"line-2"}, .at_most_s = 2.0};
  plan.routes.routes = {"chaotic-1"};
  plan.routes.at_most_s = 3.0;
  plan.occlusion.routes = {"line"};
  plan.occlusion.at_most_s = 1.0;
  plan.ablated.at_most_s = 1.0;
  plan.ablations.resize(1);
  return plan;
}

std::size_t file_count(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(Experiments, MakeTheReportFromNothingAndGoOnFromWhatIsKept) {
  const fs::path folder = fs::path(testing::TempDir()) / "skylight-experiments";
  fs::remove_all(folder);
  std::size_t reused = 0;
  const GatherOptions options{
      .folder = folder / "observed", .threads = 2, .progress = [&](const std::string&, const Progress& p) {
        if (p.done == p.total) reused += p.reused;
      }};
  const Gathered first = gather(smallest_plan(), options);
  EXPECT_EQ(reused, 0U);
  ASSERT_EQ(first.routes.size(), 1U);
  EXPECT_EQ(first.routes[0].width_px, 1920);
  const std::size_t kept = file_count(folder / "observed");
  const std::string page = report::html(document(first, {{"Command", "a test"}}));
  for (const char* id : {"table-1", "table-2", "figure-6", "figure-7", "aims", "kinds", "ablation",
                         "occlusion", "found-over-resolution", "contest-ray", "path-line-2"})
    EXPECT_THAT(page, testing::HasSubstr(std::string("id=\"") + id + "\"")) << id;

  const Gathered again = gather(smallest_plan(), options);
  EXPECT_EQ(reused, kept) << "nothing is rendered twice";
  EXPECT_EQ(file_count(folder / "observed"), kept);
  EXPECT_EQ(report::html(document(again, {{"Command", "a test"}})), page)
      << "the same figures from the files";
  fs::remove_all(folder);
}

TEST(Experiments, TheFullPlanIsThePapers) {
  const Plan plan = full_plan();
  EXPECT_EQ(plan.paper.routes.size(), 13U);
  EXPECT_EQ(plan.paper.seeds, 10);
  EXPECT_EQ(plan.paper.at_most_s, 0.0);
  EXPECT_EQ(plan.routes.routes.size() * static_cast<std::size_t>(plan.routes.seeds), 130U);
  EXPECT_GE(plan.occlusion.seeds, 30);
  EXPECT_EQ(plan.ablations.front().changes.size(), 0U) << "the first is the room as it is";
}

}  // namespace
}  // namespace skylight::service::reproduce
