// Streams, from a real ffmpeg on this machine.
#include "service/sources/live/stream_camera.hpp"

#include <future>
#include <mutex>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "service/sources/live/camera_feed.hpp"
#include "tests/support/child_process.hpp"

namespace skylight::service::test {
namespace {

using skylight::test::ChildProcess;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A socket on any free port of this machine that listens and never answers.
class SilentServer {
 public:
  SilentServer() : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd_, 4), 0);
    socklen_t length = sizeof address;
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &length), 0);
    port_ = ntohs(address.sin_port);
  }
  ~SilentServer() { ::close(fd_); }
  SilentServer(const SilentServer&) = delete;
  SilentServer& operator=(const SilentServer&) = delete;
  int port() const { return port_; }

 private:
  int fd_;
  int port_ = 0;
};

int free_port() {
  return SilentServer().port();
}

/// Red with a sensor's noise, 25 a second, in real time.
const std::vector<std::string> kRedRoom{"-re", "-f", "lavfi", "-i",
                                        "color=red:size=160x120:rate=25,noise=alls=20:allf=t"};

std::unique_ptr<ChildProcess> rtsp_server(int port) {
  std::vector<std::string> command{SKYLIGHT_PYTHON,
                                   "-B",
                                   SKYLIGHT_SOURCE_DIR "/tests/support/rtsp_server.py",
                                   "--port",
                                   std::to_string(port),
                                   "--ffmpeg",
                                   SKYLIGHT_FFMPEG};
  command.insert(command.end(), kRedRoom.begin(), kRedRoom.end());
  return std::make_unique<ChildProcess>(command);
}

/// For one client; ends when that leaves.
std::unique_ptr<ChildProcess> http_server(int port, const std::vector<std::string>& format) {
  std::vector<std::string> command{SKYLIGHT_FFMPEG, "-hide_banner", "-loglevel", "quiet", "-nostdin"};
  command.insert(command.end(), kRedRoom.begin(), kRedRoom.end());
  command.insert(command.end(), format.begin(), format.end());
  command.insert(command.end(), {"-listen", "1", "http://127.0.0.1:" + std::to_string(port) + "/camera"});
  return std::make_unique<ChildProcess>(command);
}

/// A feed on a thread of its own, with what it has handed on.
class Watched {
 public:
  explicit Watched(const std::string& url, StreamTransport transport = StreamTransport::tcp)
      : feed_({.kind = "stream", .shortest_rest = milliseconds(50), .longest_rest = milliseconds(100)},
              std::make_unique<StreamCamera>(StreamOptions{
                  .url = url, .transport = transport, .open_timeout = seconds(30), .silence = seconds(30)}),
              {.frame = [this](Frame frame) { take(std::move(frame)); }, .changed = [this] { tell(); }}),
        thread_([this] { feed_.run(); }) {}
  ~Watched() {
    feed_.interrupt();
    thread_.join();
  }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

  /// The frames, once there are so many; what there is after a minute.
  std::vector<Frame> frames(std::size_t count) {
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, std::chrono::minutes(1), [&] { return frames_.size() >= count; });
    return frames_;
  }
  FeedStatus wait_for(FeedState state) {
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, std::chrono::minutes(1), [&] { return feed_.status().state == state; });
    return feed_.status();
  }
  FeedStatus status() const { return feed_.status(); }

 private:
  void take(Frame frame) {
    const std::lock_guard lock(mutex_);
    frames_.push_back(std::move(frame));
    wake_.notify_all();
  }

  void tell() {
    const std::lock_guard lock(mutex_);
    wake_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Frame> frames_;
  CameraFeed feed_;
  std::thread thread_;
};

void expect_red_room(const std::vector<Frame>& frames, Time begin) {
  ASSERT_GE(frames.size(), 10U);
  for (const Frame& frame : frames) {
    ASSERT_EQ(frame.image.size(), cv::Size(160, 120));
    ASSERT_EQ(frame.image.type(), CV_8UC3);
  }
  const cv::Scalar mean = cv::mean(frames.back().image);
  EXPECT_LT(mean[0], 30) << "blue";
  EXPECT_LT(mean[1], 30) << "green";
  EXPECT_GT(mean[2], 220) << "red";
  EXPECT_GT(frames.front().captured, begin - seconds(1));
  EXPECT_LE(frames.back().captured, system_now()) << "never before it was taken";
}

TEST(StreamCamera, PicturesComeOverRtspAndTheStreamMayDieAndComeBack) {
  const Time begin = system_now();
  const int port = free_port();
  auto server = rtsp_server(port);
  const std::string url = server->line();
  ASSERT_THAT(url, HasSubstr("rtsp://127.0.0.1:" + std::to_string(port)));
  Watched camera(url);
  const auto frames = camera.frames(20);
  expect_red_room(frames, begin);
  // The stream's own times say how far apart they were taken; arrivals would jitter.
  for (std::size_t i = 11; i < frames.size(); ++i) {
    const double apart = to_seconds(frames[i].captured - frames[i - 1].captured);
    const auto steps = static_cast<double>(frames[i].sequence - frames[i - 1].sequence);
    EXPECT_GE(apart, 0.0) << i;
    EXPECT_LE(apart, 0.04 * steps + 0.002) << i << ": an earlier one only makes it less";
  }
  server->kill();
  EXPECT_NE(camera.wait_for(FeedState::failed).reason, "");
  server = rtsp_server(port);
  ASSERT_EQ(server->line(), url);
  EXPECT_EQ(camera.wait_for(FeedState::running).reconnects, 1U);
  EXPECT_GT(camera.frames(frames.size() + 5).size(), frames.size());
}

TEST(StreamCamera, RtspMaySendBesideItsConnection) {
  const Time begin = system_now();
  auto server = rtsp_server(0);
  Watched camera(server->line(), StreamTransport::udp);
  expect_red_room(camera.frames(10), begin);
}

TEST(StreamCamera, MjpegOverHttpIsDatedByItsArrival) {
  const Time begin = system_now();
  const int port = free_port();
  const auto server = http_server(port, {"-q:v", "3", "-f", "mpjpeg"});
  Watched camera("http://127.0.0.1:" + std::to_string(port) + "/camera");  // tries until the server is there
  expect_red_room(camera.frames(10), begin);
  EXPECT_LT(camera.status().delay.value(), seconds(1));
  EXPECT_GE(camera.status().delay.value(), Duration{});
}

TEST(StreamCamera, MpegTransportStreamsComeOverHttp) {
  const Time begin = system_now();
  const int port = free_port();
  const auto server = http_server(port, {"-c:v", "mpeg2video", "-q:v", "4", "-f", "mpegts"});
  Watched camera("http://127.0.0.1:" + std::to_string(port) + "/camera");
  expect_red_room(camera.frames(10), begin);
}

std::string opening(const StreamOptions& options) {
  StreamCamera camera(options);
  try {
    camera.open();
  } catch (const SourceError& error) {
    return error.what();
  }
  return "opened";
}

TEST(StreamCamera, SaysWhatIsWrongAndNeverThePassword) {
  const std::string address = "127.0.0.1:" + std::to_string(free_port());
  EXPECT_THAT(
      opening({.url = "rtsp://admin:secret@" + address + "/camera"}),
      AllOf(HasSubstr("rtsp://" + address + "/camera: Connection refused"), Not(HasSubstr("secret"))));
  const SilentServer silent;
  EXPECT_THAT(opening({.url = "http://admin:secret@127.0.0.1:" + std::to_string(silent.port()) + "/",
                       .open_timeout = milliseconds(50)}),
              AllOf(HasSubstr("does not answer"), Not(HasSubstr("secret"))));
}

TEST(StreamCamera, FilesOfThisMachineAreOutOfReach) {
  EXPECT_THAT(opening({.url = "file:///etc/hostname"}), Not(HasSubstr("opened")));
  EXPECT_THAT(opening({.url = "concat:/etc/hostname"}), Not(HasSubstr("opened")));
}

TEST(StreamCamera, AWaitIsEndedByInterrupt) {
  const SilentServer silent;
  for (const char* scheme : {"rtsp://", "http://"}) {
    StreamCamera camera({.url = scheme + std::string("127.0.0.1:") + std::to_string(silent.port()) + "/",
                         .open_timeout = std::chrono::hours(1)});
    std::promise<void> begun;
    auto open = std::async(std::launch::async, [&] {
      begun.set_value();
      camera.open();
    });
    begun.get_future().wait();
    camera.interrupt();
    try {
      open.get();
      ADD_FAILURE() << "opened";
    } catch (const SourceError& error) {
      EXPECT_THAT(error.what(), HasSubstr("interrupted"));
    }
  }
}

TEST(StreamCamera, PasswordsAreLeftOutOfAddresses) {
  EXPECT_EQ(without_password("rtsp://u:p@host:554/a?b=c@d"), "rtsp://host:554/a?b=c@d");
  EXPECT_EQ(without_password("rtsp://u:p@ss@host/a"), "rtsp://host/a");
  EXPECT_EQ(without_password("http://host/a@b"), "http://host/a@b");
  EXPECT_EQ(without_password("nonsense"), "nonsense");
}

}  // namespace
}  // namespace skylight::service::test
