// Who disagrees, and since when: against cases worked out by hand.
#include "service/camera_agreement.hpp"

#include <memory>

#include <gmock/gmock.h>

namespace skylight::service::test {
namespace {

/// Says what it is told to say of the cameras, and nothing else.
class Says final : public Filter {
 public:
  explicit Says(std::vector<CameraOpinion> opinions) : opinions_(std::move(opinions)) {}
  FilterStep update(Time, const std::optional<Observation>&) override { return {}; }
  bool odometry(const BodyVelocity&) override { return false; }
  std::optional<Estimate> predict(Time) const override { return std::nullopt; }
  Duration smoothing_lag() const override { return {}; }
  std::optional<Estimate> smoothed(Time) const override { return std::nullopt; }
  std::vector<Estimate> smoothed_from(Time) const override { return {}; }
  std::vector<CameraOpinion> opinions() const override { return opinions_; }
  void reset() override {}
  std::unique_ptr<Filter> clone() const override { return std::make_unique<Says>(*this); }

 private:
  std::vector<CameraOpinion> opinions_;
};

RobotView robot(std::vector<CameraOpinion> opinions) {
  return {.id = "anna", .filter = std::make_shared<Says>(std::move(opinions))};
}

CameraOpinion sees(std::size_t camera, double sigmas, int refused = 0) {
  return {.camera = camera, .off_m = {0.001 * sigmas, 0.0}, .sigmas = sigmas, .refused = refused};
}

Time at(double s) {
  return Time{} + from_seconds(1000.0 + s);
}

TEST(CameraAgreements, ItTakesASecondOfMoreThanThreeSigmaAndAsLongOfCalmToAgreeAgain) {
  CameraAgreements agreements(2);
  std::vector<std::pair<double, bool>> told;
  for (int i = 0; i < 200; ++i) {
    const double t = i / 20.0;
    // From 6 s on neither enough to accuse it nor so little that it is calm.
    const double sigmas = t < 2.0 || t >= 8.0 ? 1.0 : t < 6.0 ? 3.5 : 2.8;
    for (const AgreementChange& change : agreements.see(at(t), {robot({sees(0, 0.0), sees(1, sigmas, 9)})})) {
      EXPECT_EQ(change.camera, 1U);
      EXPECT_TRUE(change.state.refused);
      told.emplace_back(t, change.disagrees);
    }
  }
  EXPECT_THAT(told, testing::ElementsAre(testing::Pair(3.0, true), testing::Pair(9.0, false)));
}

TEST(CameraAgreements, NeitherOutliersNorFramesWithoutARobotCount) {
  CameraAgreements agreements(2);
  for (int i = 0; i < 200; ++i) {
    const double sigmas = i % 10 == 0 ? 1.0 : 8.0;  // never a whole second
    EXPECT_TRUE(agreements.see(at(i / 20.0), {robot({sees(0, 0.0), sees(1, sigmas)})}).empty());
  }
  EXPECT_FALSE(agreements.disagrees(1));
  agreements.see(at(20.0), {});
  EXPECT_FALSE(agreements.of(1)) << "nobody is seen by two";
  agreements.see(at(20.1), {robot({sees(1, 8.0)})});
  EXPECT_FALSE(agreements.of(1)) << "one camera has nobody to contradict";
}

TEST(CameraAgreements, TwoFramesFarApartAreNoSecondOfDisagreement) {
  CameraAgreements agreements(2);
  const std::vector<RobotView> off{robot({sees(0, 0.0), sees(1, 8.0)})};
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(agreements.see(at(60.0 * i), off).empty()) << i;
    agreements.see(at(60.0 * i + 0.1), {});  // and out of the overlap again
  }
  // Frames in between that tell nothing do not begin it anew.
  std::size_t told = 0;
  for (int i = 0; i < 25; ++i)
    told += agreements.see(at(900.0 + i / 20.0), i % 2 == 0 ? off : std::vector<RobotView>{}).size();
  EXPECT_EQ(told, 1U);
}

TEST(CameraAgreements, TheRobotForWhichItIsFurthestOffSpeaksForACamera) {
  CameraAgreements agreements(3);
  agreements.see(at(0.0), {robot({sees(0, 0.5), sees(1, 1.0)}), robot({sees(1, 2.0), sees(2, 0.1)}),
                           robot({sees(0, 0.2), sees(1, 0.3), sees(2, 0.4)})});
  ASSERT_TRUE(agreements.of(0) && agreements.of(1) && agreements.of(2));
  EXPECT_EQ(agreements.of(0)->robots, 2);
  EXPECT_EQ(agreements.of(1)->robots, 3);
  EXPECT_EQ(agreements.of(1)->sigmas, 2.0);
  EXPECT_DOUBLE_EQ(agreements.of(1)->off_m, 0.002);
  EXPECT_EQ(agreements.of(2)->sigmas, 0.4);
}

}  // namespace
}  // namespace skylight::service::test
