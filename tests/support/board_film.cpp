// A chessboard of 9 x 6 inner corners, squares of 60 mm, held before the simulator's camera: what somebody
// does to calibrate its lens, as a film. For the guide deploy/own-camera.md, where no camera is at hand.
//
//     board_film FILE.mp4
//
// 20 places, each for 1 s at 10 frames/s and 1920 x 1080 px.
#include <cstdio>
#include <exception>
#include <stdexcept>

#include <opencv2/videoio.hpp>

#include "sim/scenario/camera.hpp"
#include "tests/support/board_scene.hpp"

namespace skylight::test {
namespace {

constexpr int kPlaces = 20;
constexpr int kFramesAtEach = 10;
constexpr double kRate = 10.0;      // frames/s
constexpr double kDistance = 0.95;  // m, more or less, from the lens
constexpr double kSquare = 0.06;    // m
constexpr std::uint64_t kSeed = 1;

void film(const std::string& path) {
  const sim::CameraParameters camera = sim::camera_model(sim::CameraSpec{}).parameters();
  cv::VideoWriter out;
  if (!out.open(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), kRate,
                {camera.width_px, camera.height_px}))
    throw std::runtime_error(path + ": cannot be written");
  BoardScene scene{.camera = camera, .seed = kSeed};
  for (const Eigen::Isometry3d& pose : held_boards(sim::CameraModel(camera), kPlaces, kDistance, kSeed)) {
    scene.prints = {chessboard_print(9, 6, kSquare, camera.map_from_camera * pose)};
    for (int i = 0; i < kFramesAtEach; ++i) {
      ++scene.frame;
      out.write(scene.render());
    }
  }
}

}  // namespace
}  // namespace skylight::test

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: board_film FILE.mp4\n");
    return 2;
  }
  try {
    skylight::test::film(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "board_film: %s\n", error.what());
    return 1;
  }
  return 0;
}
