#include "service/calibration/board.hpp"

#include <gmock/gmock.h>
#include <opencv2/aruco/charuco.hpp>

#include "tests/service/calibration/cameras.hpp"

namespace skylight::calibration {
namespace {

using testing::HasSubstr;

std::string refusal(const std::string& text) {
  try {
    parse_board(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

/// Distance of the corners found from where the simulator's projection has them: {root mean square, largest}.
struct Off {
  double rms = 0.0;
  double largest = 0.0;
};
Off off(const BoardSighting& seen, const Board& board, const sim::CameraModel& camera,
        const Eigen::Isometry3d& pose) {
  Off out;
  const auto points = board_points(board);
  for (std::size_t i = 0; i < seen.corners.size(); ++i) {
    const auto truth = camera.project(pose * points[static_cast<std::size_t>(seen.corners[i])]);
    const double distance = (seen.pixels[i] - truth.value()).norm();
    out.rms += distance * distance / static_cast<double>(seen.corners.size());
    out.largest = std::max(out.largest, distance);
  }
  out.rms = std::sqrt(out.rms);
  return out;
}

const Board kChess{.columns = 9, .rows = 6, .square_m = 0.03};
const Board kCharuco{.kind = BoardKind::charuco,
                     .columns = 8,
                     .rows = 6,
                     .square_m = 0.04,
                     .marker_m = 0.03,
                     .dictionary = "4x4_50"};

cv::Ptr<cv::aruco::CharucoBoard> drawn_charuco(int columns, int rows) {
  return cv::aruco::CharucoBoard::create(columns, rows, 0.04F, 0.03F,
                                         cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
}

test::BoardScene scene_with(const test::Print& print) {
  return {.camera = test::small_camera(), .prints = {print}};
}

Eigen::Isometry3d held(double turn = 0.0) {
  return test::camera_from_held(
      sim::CameraModel(test::small_camera()),
      {.pixel = {300, 250}, .distance_m = 0.55, .tilt_right = 0.4, .tilt_down = -0.3, .turn = turn});
}
/// From the optical frame to the map that prints are placed in.
Eigen::Isometry3d in_map(const Eigen::Isometry3d& camera_from_print) {
  return test::small_camera().map_from_camera * camera_from_print;
}

TEST(Boards, AreReadAndWritten) {
  const Board chess = parse_board("chessboard:9x6:0.025");
  EXPECT_EQ(chess.columns, 9);
  EXPECT_EQ(chess.rows, 6);
  EXPECT_EQ(chess.square_m, 0.025);
  const Board charuco = parse_board("charuco:8x6:0.04:0.03:4x4_50");
  EXPECT_EQ(charuco.corner_columns(), 7);
  EXPECT_EQ(charuco.marker_m, 0.03);
  for (const char* text : {"chessboard:9x6:0.025", "charuco:8x6:0.04:0.03:4x4_50"})
    EXPECT_EQ(to_string(parse_board(text)), text);
}

TEST(Boards, WrittenWrongAreRefusedInWords) {
  EXPECT_THAT(refusal("checkers:9x6:0.02"), HasSubstr("chessboard:9x6:0.025"));
  EXPECT_THAT(refusal("chessboard:9:0.02"), HasSubstr("\"9\" is no count"));
  EXPECT_THAT(refusal("chessboard:9x6:25"), HasSubstr("allowed 0.001 to 10"));
  EXPECT_THAT(refusal("chessboard:2x6:0.02"), HasSubstr("allowed 3 to 100"));
  EXPECT_THAT(refusal("charuco:8x6:0.03:0.04:4x4_50"), HasSubstr("smaller than the square"));
  EXPECT_THAT(refusal("charuco:8x6:0.04:0.03:9x9_50"), HasSubstr("apriltag_36h11"));
  EXPECT_THAT(refusal(""), HasSubstr("a board is written"));
}

TEST(FindBoard, FindsChessboardCornersToATenthOfAPixel) {
  const sim::CameraModel camera(test::small_camera());
  std::string why;
  // Whichever way round it is held, the board's own frame is the same.
  for (const double turn : {0.0, 1.5, 3.0, -1.6}) {
    const auto image = scene_with(test::chessboard_print(9, 6, 0.03, in_map(held(turn)))).render();
    const auto seen = find_board(image, kChess, why);
    ASSERT_TRUE(seen) << why;
    EXPECT_EQ(seen->corners.size(), 54U);
    EXPECT_LT(off(*seen, kChess, camera, held(turn)).rms, 0.1) << "turn " << turn;
  }
}

TEST(FindBoard, FindsWhatIsSeenOfACharucoBoard) {
  const sim::CameraModel camera(test::small_camera());
  auto scene = scene_with(test::charuco_print(drawn_charuco(8, 6), in_map(held())));
  std::string why;
  const auto whole = find_board(scene.render(), kCharuco, why);
  ASSERT_TRUE(whole) << why;
  EXPECT_EQ(whole->corners.size(), 35U);
  EXPECT_LT(off(*whole, kCharuco, camera, held()).rms, 0.15);
  cv::Mat half = scene.render();
  half(cv::Rect(0, 0, 300, 480)).setTo(cv::Scalar(90, 90, 90));
  const auto part = find_board(half, kCharuco, why);
  ASSERT_TRUE(part) << why;
  EXPECT_LT(part->corners.size(), 30U);
  EXPECT_LT(off(*part, kCharuco, camera, held()).rms, 0.2);
}

TEST(FindBoard, SaysWhatIsWrongWithTheDescription) {
  std::string why;
  const auto chess = scene_with(test::chessboard_print(8, 5, 0.03, in_map(held()))).render();
  EXPECT_FALSE(find_board(chess, kChess, why));
  EXPECT_THAT(why, HasSubstr("9x6"));
  EXPECT_THAT(suspect_board(chess, kChess), HasSubstr("8x5 inner corners"));

  const auto charuco = scene_with(test::charuco_print(drawn_charuco(8, 6), in_map(held()))).render();
  cv::Mat mirrored;
  cv::flip(charuco, mirrored, 1);
  EXPECT_FALSE(find_board(mirrored, kCharuco, why));
  EXPECT_THAT(suspect_board(mirrored, kCharuco), HasSubstr("mirrored"));

  Board other = kCharuco;
  other.marker_m = 0.02;
  EXPECT_FALSE(find_board(charuco, other, why));
  EXPECT_THAT(why, HasSubstr("of a square, by the description 50 %"));
  other = kCharuco;
  other.columns = 6;
  EXPECT_FALSE(find_board(charuco, other, why));
  EXPECT_THAT(why, HasSubstr("marker 2"));
  other = kCharuco;
  other.columns = 10;
  EXPECT_FALSE(find_board(charuco, other, why));
  EXPECT_THAT(why, HasSubstr("10x6 squares"));
  other = kCharuco;
  other.dictionary = "5x5_100";
  EXPECT_FALSE(find_board(charuco, other, why));
  EXPECT_THAT(suspect_board(charuco, other), HasSubstr("4x4_"));
}

TEST(FindBoard, FindsNothingInAnEmptyRoom) {
  const test::BoardScene empty{.camera = test::small_camera()};
  std::string why;
  EXPECT_FALSE(find_board(empty.render(), kChess, why));
  EXPECT_FALSE(find_board(empty.render(), kCharuco, why));
  EXPECT_THAT(suspect_board(empty.render(), kChess), testing::IsEmpty());
  EXPECT_THAT(suspect_board(empty.render(), kCharuco), testing::IsEmpty());
}

}  // namespace
}  // namespace skylight::calibration
