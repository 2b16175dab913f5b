#include "service/reproduce/jobs.hpp"

#include <atomic>
#include <fstream>

#include <gmock/gmock.h>
#include <opencv2/core/utility.hpp>

#include "tests/service/simulated_room.hpp"

namespace skylight::service::reproduce {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

class Jobs : public testing::Test {
 protected:
  /// Gives a run with this seed, and counts that it was done.
  Job job(std::uint64_t seed, const std::string& key = "same settings") {
    return {.name = "route seed " + std::to_string(seed),
            .key = key + " seed " + std::to_string(seed),
            .run = [this, seed] {
              ++runs_;
              return ObservedRun{.route = "route", .seed = seed};
            }};
  }
  std::vector<Job> jobs(std::size_t count, const std::string& key = "same settings") {
    std::vector<Job> out;
    for (std::size_t i = 0; i < count; ++i) out.push_back(job(i + 1, key));
    return out;
  }
  JobOptions options(std::size_t threads = 2) {
    return {.folder = folder_.path / "kept", .threads = threads};
  }
  static std::vector<std::uint64_t> seeds(const std::vector<ObservedRun>& runs) {
    std::vector<std::uint64_t> out;
    for (const auto& run : runs) out.push_back(run.seed);
    return out;
  }

  test::RoomFolder folder_;
  std::atomic<int> runs_{0};
};

TEST_F(Jobs, GiveTheirResultsInOrderOnAnyNumberOfThreads) {
  for (const std::size_t threads : {1u, 2u, 7u}) {
    std::filesystem::remove_all(folder_.path / "kept");
    EXPECT_THAT(seeds(run_jobs(jobs(5), options(threads))), ElementsAre(1, 2, 3, 4, 5)) << threads;
  }
  EXPECT_EQ(runs_, 15);
  EXPECT_TRUE(run_jobs({}, options()).empty());
}

TEST_F(Jobs, AreNotDoneAgain) {
  run_jobs(jobs(3), options());
  EXPECT_EQ(runs_, 3);
  EXPECT_THAT(seeds(run_jobs(jobs(5), options())), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_EQ(runs_, 5);
}

TEST_F(Jobs, AreDoneAnewUnderAnyOtherKey) {
  run_jobs(jobs(3), options());
  run_jobs(jobs(3, "Same settings"), options());
  EXPECT_EQ(runs_, 6);
  run_jobs(jobs(3), options());  // what was kept of the first is still there
  EXPECT_EQ(runs_, 6);
}

TEST_F(Jobs, TakeNoFileOfAnotherKeyUnderTheirOwnName) {
  run_jobs(jobs(1), options());
  const Job other = job(1, "other settings");
  std::filesystem::rename(job_file(options().folder, jobs(1)[0]), job_file(options().folder, other));
  run_jobs({other}, options());
  EXPECT_EQ(runs_, 2);
}

TEST_F(Jobs, GoOnWhereTheyWereInterrupted) {
  auto broken = jobs(4);
  broken[2].run = []() -> ObservedRun { throw std::runtime_error("the lamp fell down"); };
  try {
    run_jobs(broken, options(1));
    FAIL() << "nothing was told";
  } catch (const JobError& error) {
    EXPECT_STREQ(error.what(), "route seed 3: the lamp fell down");
  }
  EXPECT_EQ(runs_, 2);
  EXPECT_THAT(seeds(run_jobs(jobs(4), options(1))), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(runs_, 4);
}

TEST_F(Jobs, LeaveNoHalfAFileWhereOneFails) {
  auto broken = jobs(1);
  broken[0].run = []() -> ObservedRun { throw 7; };
  EXPECT_THROW(run_jobs(broken, options()), JobError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path / "kept"));
}

TEST_F(Jobs, AreDoneAnewWhereTheirFileIsDamaged) {
  run_jobs(jobs(2), options());
  std::filesystem::resize_file(job_file(options().folder, jobs(2)[1]), 100);
  // What a program that was killed while it wrote leaves behind is in nobody's way.
  std::ofstream(job_file(options().folder, jobs(2)[1]).string() + ".part") << "skylight obs";
  EXPECT_THAT(seeds(run_jobs(jobs(2), options())), ElementsAre(1, 2));
  EXPECT_EQ(runs_, 3);
  run_jobs(jobs(2), options());
  EXPECT_EQ(runs_, 3);
}

TEST_F(Jobs, TellTheirProgressByWeight) {
  run_jobs({job(1)}, options());
  auto four = jobs(3);
  four[0].weight = 2.0;
  four[2].weight = 5.0;
  std::vector<double> shares;
  std::vector<std::string> told;
  JobOptions watched = options(1);
  watched.progress = [&](const Progress& progress) {
    EXPECT_EQ(progress.reused, 1u);
    EXPECT_EQ(progress.total, 3u);
    EXPECT_EQ(progress.done, shares.size() + 1);
    shares.push_back(progress.share);
    told.push_back(progress.job);
  };
  run_jobs(four, watched);
  EXPECT_THAT(shares, ElementsAre(0.25, 0.375, 1.0));
  EXPECT_THAT(told, ElementsAre("", "route seed 2", "route seed 3"));
}

TEST_F(Jobs, HaveOneThreadOfOpenCvEach) {
  const int before = cv::getNumThreads();
  auto one = jobs(1);
  int inside = 0;
  one[0].run = [&inside] {
    inside = cv::getNumThreads();
    return ObservedRun{.route = "route"};
  };
  run_jobs(one, options());
  EXPECT_EQ(inside, 1);
  EXPECT_EQ(cv::getNumThreads(), before);
}

TEST_F(Jobs, WithTheSameNameAndKeyAreRefused) {
  EXPECT_THROW(run_jobs({job(1), job(1)}, options()), std::invalid_argument);
}

TEST_F(Jobs, HaveFilesThatTellWhatTheyAre) {
  Job odd = job(1);
  odd.name = "paper/line-1 seed 3";
  EXPECT_THAT(job_file("kept", odd).string(), HasSubstr("kept/paper_line-1_seed_3-"));
  EXPECT_THAT(job_file("kept", odd).string(), EndsWith(".csv"));
}

TEST_F(Jobs, TellWhereTheirFolderCannotBeMade) {
  std::ofstream(folder_.path / "kept") << "a file in the way";
  EXPECT_THROW(run_jobs(jobs(1), options()), JobError);
}

}  // namespace
}  // namespace skylight::service::reproduce
