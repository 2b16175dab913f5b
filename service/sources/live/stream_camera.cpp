#include "service/sources/live/stream_camera.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <mutex>
#include <utility>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/error.h>
#include <libswscale/swscale.h>
}

namespace skylight::service {
namespace {

using Steady = std::chrono::steady_clock;

std::string words(int error) {
  if (error == AVERROR_EOF) return "the stream ended";
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

struct Options {
  AVDictionary* all = nullptr;
  Options() = default;
  ~Options() { av_dict_free(&all); }
  Options(const Options&) = delete;
  Options& operator=(const Options&) = delete;
  void set(const char* key, const char* value) { av_dict_set(&all, key, value, 0); }
};

// What the packets' times are worth: of formats without any the library counts 25 a second, come what may.
bool has_times(const AVInputFormat& format) {
  const std::string name = format.name;
  return (format.flags & AVFMT_NOTIMESTAMPS) == 0 && name.find("mjpeg") == std::string::npos;
}

}  // namespace

std::string without_password(const std::string& url) {
  const auto scheme = url.find("://");
  if (scheme == std::string::npos) return url;
  const auto begin = scheme + 3;
  const auto at = url.substr(begin, url.find_first_of("/?#", begin) - begin).rfind('@');
  return at == std::string::npos ? url : url.substr(0, begin) + url.substr(begin + at + 1);
}

// Everything that belongs to FFmpeg.
class StreamCamera::Stream {
 public:
  explicit Stream(StreamOptions options)
      : options_(std::move(options)), name_(without_password(options_.url)) {
    static std::once_flag once;
    std::call_once(once, [] { av_log_set_level(AV_LOG_FATAL); });  // what it has to say is told by our errors
  }
  ~Stream() { close(); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void open() {
    close();
    deadline_ = Steady::now() + options_.open_timeout;
    open_input();
    open_decoder();
    packet_ = av_packet_alloc();
    decoded_ = av_frame_alloc();
    if (packet_ == nullptr || decoded_ == nullptr) fail("no memory");
  }

  Shot read() {
    deadline_ = Steady::now() + options_.silence;
    for (;;) {
      const int got = avcodec_receive_frame(decoder_, decoded_);
      if (got >= 0) {
        Shot shot = picture();
        begun_ = begun_ || shot.unreadable.empty();
        if (begun_) return shot;
        continue;
      }
      const int refused = got == AVERROR(EAGAIN) ? feed() : got;
      // Who joins in the middle gets parts of pictures until the first whole one.
      if (refused < 0 && begun_) return {.unreadable = words(refused), .arrived = arrived_};
    }
  }

  void close() {
    sws_freeContext(std::exchange(scaler_, nullptr));
    av_frame_free(&decoded_);
    av_packet_free(&packet_);
    avcodec_free_context(&decoder_);
    avformat_close_input(&input_);
    stream_index_ = -1;
    begun_ = false;
  }

  void interrupt() { interrupted_ = true; }

 private:
  // Asked by the library while it waits.
  static int is_over(void* stream) {
    const auto& self = *static_cast<const Stream*>(stream);
    return self.interrupted_ || Steady::now() > self.deadline_ ? 1 : 0;
  }

  [[noreturn]] void fail(const std::string& why) const { throw SourceError(name_ + ": " + why); }
  [[noreturn]] void fail(int error, const char* silent) const {
    if (interrupted_) fail("interrupted");
    fail(error == AVERROR_EXIT || Steady::now() > deadline_ ? silent : words(error));
  }

  void open_input() {
    input_ = avformat_alloc_context();
    if (input_ == nullptr) fail("no memory");
    input_->interrupt_callback = {.callback = &is_over, .opaque = this};
    Options options;
    options.set("rtsp_transport", options_.transport == StreamTransport::tcp ? "tcp" : "udp");
    options.set("protocol_whitelist", "rtsp,rtsps,rtp,srtp,udp,tcp,http,https,httpproxy,tls,crypto");
    options.set("fflags", "nobuffer");
    options.set("analyzeduration", "1000000");
    if (const int error = avformat_open_input(&input_, options_.url.c_str(), nullptr, &options.all);
        error < 0)
      fail(error, "does not answer");
    if (const int error = avformat_find_stream_info(input_, nullptr); error < 0)
      fail(error, "sends no picture");
    timed_ = has_times(*input_->iformat);
  }

  void open_decoder() {
    const AVCodec* codec = nullptr;
    stream_index_ = av_find_best_stream(input_, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_index_ < 0 || codec == nullptr) fail("has no picture that can be decoded");
    decoder_ = avcodec_alloc_context3(codec);
    if (decoder_ == nullptr) fail("no memory");
    avcodec_parameters_to_context(decoder_, stream().codecpar);
    decoder_->pkt_timebase = stream().time_base;
    decoder_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    decoder_->thread_type = FF_THREAD_SLICE;  // threads for whole frames keep as many pictures back
    decoder_->max_pixels = kMaxPicturePixels;
    if (const int error = avcodec_open2(decoder_, codec, nullptr); error < 0) fail(words(error));
  }

  AVStream& stream() const { return *input_->streams[stream_index_]; }

  // The next packet to the decoder; negative where the decoder refuses it.
  int feed() {
    for (;;) {
      av_packet_unref(packet_);
      if (const int error = av_read_frame(input_, packet_); error < 0)
        fail(error, "sends no picture any more");
      if (packet_->stream_index != stream_index_) continue;
      arrived_ = options_.clock();
      return avcodec_send_packet(decoder_, packet_);
    }
  }

  Shot picture() {
    Shot out{.arrived = arrived_};
    const std::int64_t time = decoded_->best_effort_timestamp;
    if (timed_ && time != AV_NOPTS_VALUE)
      out.stamp = Duration{av_rescale_q(time, stream().time_base, AVRational{1, 1'000'000'000})};
    const bool damaged = (decoded_->flags & AV_FRAME_FLAG_CORRUPT) != 0 || decoded_->decode_error_flags != 0;
    if (damaged) {
      out.unreadable = "the decoder calls it damaged";
    } else if (!convert(out.image)) {
      out.unreadable = "its pixels cannot be converted";
    }
    av_frame_unref(decoded_);
    return out;
  }

  bool convert(cv::Mat& image) {
    const auto format = static_cast<AVPixelFormat>(decoded_->format);
    const bool grey = format == AV_PIX_FMT_GRAY8;
    scaler_ =
        sws_getCachedContext(scaler_, decoded_->width, decoded_->height, format, decoded_->width,
                             decoded_->height, grey ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_BGR24,
                             SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr);
    if (scaler_ == nullptr) return false;
    image.create(decoded_->height, decoded_->width, grey ? CV_8UC1 : CV_8UC3);
    std::array<std::uint8_t*, 1> to{image.data};
    const std::array<int, 1> step{static_cast<int>(image.step)};
    return sws_scale(scaler_, decoded_->data, decoded_->linesize, 0, decoded_->height, to.data(),
                     step.data()) == decoded_->height;
  }

  StreamOptions options_;
  std::string name_;
  std::atomic<bool> interrupted_{false};
  Steady::time_point deadline_{};
  AVFormatContext* input_ = nullptr;
  AVCodecContext* decoder_ = nullptr;
  AVPacket* packet_ = nullptr;
  AVFrame* decoded_ = nullptr;
  SwsContext* scaler_ = nullptr;
  int stream_index_ = -1;
  bool timed_ = false;
  bool begun_ = false;  ///< there was a whole picture
  Time arrived_{};
};

StreamCamera::StreamCamera(StreamOptions options) : stream_(std::make_unique<Stream>(std::move(options))) {}

StreamCamera::~StreamCamera() = default;

void StreamCamera::open() {
  stream_->open();
}

Shot StreamCamera::read() {
  return stream_->read();
}

void StreamCamera::close() {
  stream_->close();
}

void StreamCamera::interrupt() {
  stream_->interrupt();
}

}  // namespace skylight::service
