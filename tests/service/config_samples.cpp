// Prints samples for tests/settings/check_schema.py; with --schema what deploy/skylight.schema.json has to
// hold.
#include <cstdio>
#include <string_view>

#include "service/config.hpp"
#include "tests/settings/samples.hpp"

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--schema") {
    std::fputs(skylight::service::config_schema().c_str(), stdout);
    return 0;
  }
  // array(): compilers differ on what braces around a single json mean.
  const nlohmann::json all = nlohmann::json::array({skylight::test::samples<skylight::service::Config>(
      "Configuration",
      {"{}",
       R"({"server": {"port": 65535}})",
       R"({"server": {"port": 65536}})",
       R"({"server": {"prot": 1}})",
       R"({"server": {"token_sha256": "0"}})",
       R"({"source": {"speed": 2}})",
       R"({"source": {"path": "a.mp4"}})",
       R"({"source": {"type": "simulator", "scenario": "a", "seed": 18446744073709551615}})",
       R"({"source": {"type": "simulator", "loop": true}})",
       R"({"source": {"type": "video", "path": "a.mp4"}})",
       R"({"cameras": [{"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]}}],
           "source": {"type": "folder", "path": "a", "camera": "c", "start_s": 1.5},
           "appearances": [{"id": "a", "image": "a.png", "metres_per_pixel": 0.001}],
           "robots": [{"id": "r", "appearance": "a", "initial_pose": {"x_m": 1, "y_m": 2},
                       "filter": {"type": "window", "alpha": 0.1}, "homography": {"reference_m": [0.1, 0]}}]})",
       R"({"cameras": [{"id": "c"}]})",
       R"({"source": {"type": "cameras"},
           "cameras": [{"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]},
                        "source": {"type": "v4l2", "device": "/dev/video0", "format": "GREY", "latency_s": 0.1}}]})",
       R"({"cameras": [{"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]},
                        "source": {"device": "/dev/video0"}}]})",
       R"({"cameras": [{"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]},
                        "source": {"type": "stream", "url": "ftp://cam/1"}}]})",
       R"({"cameras": [{"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]},
                        "source": {"type": "posted", "url": "rtsp://cam/1"}}]})",
       R"({"cameras": [{"id": "c d"}]})",
       R"({"appearances": [{"id": "a"}]})",
       R"({"robots": [{"id": "r", "initial_pose": {"x_m": 1}}]})",
       R"({"robots": [{"id": "r"}]})",
       R"({"robots": [{"id": "r", "filter": {"type": "none"}}]})",
       R"({"tracker": {"filter": {"alpha": 0}}})",
       R"({"robots": [{"id": "r", "detector": "apriltag", "tag": {"id": 3}}]})",
       R"({"robots": [{"id": "r", "tag": {"family": "Standard41h12", "id": 2114, "size_m": 0.1, "height_m": 0.2,
                       "position_m": [0.1, -0.1], "yaw_rad": 1.5}}]})",
       R"({"robots": [{"id": "r", "tag": {"id": -1}}]})",
       R"({"robots": [{"id": "r", "tag": {"size_m": 0.1}}]})",
       R"({"robots": [{"id": "r", "tag": {"id": 3, "family": "tag36h11"}}]})",
       R"({"robots": [{"id": "r", "tag": {"id": 3, "size_m": 0}}]})",
       R"({"tracker": {"detector": "apriltag"}})",
       R"({"tracker": {"detector": "sift"}})",
       R"({"floor": {"masks": [{"name": "a", "corners_m": [[0, 0], [1, 0], [0, 1.5]]}]}})",
       R"({"floor": {"masks": [{"name": "a", "corners_m": [[0, 0], [1, 0]]}]}})",
       R"({"floor": {"masks": [{"corners_m": [[0, 0], [1, 0], [0, 1]]}]}})",
       R"({"camera_watch": {"recalibrate": true}})",
       R"({"log": {"level": "error"}})",
       R"({"history": {"max_age_s": 0}})"})});
  std::puts(all.dump().c_str());
}
