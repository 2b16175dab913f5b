#include "service/reproduce/observed_run.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <system_error>

namespace skylight::service::reproduce {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTitle = "skylight observed run";
constexpr std::string_view kRunColumns = "route,seed,frame_rate_hz,width_px,height_px";
constexpr std::string_view kFrameColumns =
    "captured_ns,truth_x_m,truth_y_m,truth_yaw_rad,in_view,visible; of each variant: captured_ns,x_m,y_m,"
    "yaw_rad,covariance (9),correlated (9),source,camera,score,heading_turns";
constexpr std::string_view kOdometryColumns = "at_ns,forward_mps,sideways_mps,yaw_rate_radps,covariance (9)";
constexpr std::size_t kFieldsOfObservation = 26;
constexpr std::size_t kMostFrames = 10'000'000;
constexpr std::array kSources{PoseSource::orb,      PoseSource::align, PoseSource::homography,
                              PoseSource::apriltag, PoseSource::depth, PoseSource::prediction};

// ---- writing

class Line {
 public:
  explicit Line(std::string& out) : out_(out) {}
  ~Line() { out_ += '\n'; }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  Line& text(std::string_view value) {
    if (!first_) out_ += ',';
    first_ = false;
    out_ += value;
    return *this;
  }
  template <class Number>
  Line& number(Number value) {
    std::array<char, 32> buffer{};
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
    return text({buffer.data(), static_cast<std::size_t>(end - buffer.data())});
  }
  Line& time(Time value) { return number(value.time_since_epoch().count()); }
  Line& matrix(const Covariance3& value) {
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) number(value(row, column));
    return *this;
  }

 private:
  std::string& out_;
  bool first_ = true;
};

void write_observation(Line& line, const std::optional<Observation>& seen) {
  if (!seen) {
    for (std::size_t i = 0; i < kFieldsOfObservation; ++i) line.text("");
    return;
  }
  line.time(seen->captured).number(seen->pose.x).number(seen->pose.y).number(seen->pose.yaw);
  line.matrix(seen->covariance).matrix(seen->correlated);
  line.text(to_string(seen->source)).number(seen->camera).number(seen->score).number(seen->heading_turns);
}

void check_name(std::string_view name, const char* what) {
  if (name.empty() || name.find_first_of(",\"\n\r") != std::string_view::npos) {
    throw std::invalid_argument(std::string(what) + " \"" + std::string(name) +
                                "\": must be some text without commas, quotes and line breaks");
  }
}

void check_run(const ObservedRun& run) {
  check_name(run.route, "route");
  for (const std::string& variant : run.variants) check_name(variant, "variant");
  for (const ObservedFrame& frame : run.frames) {
    if (frame.seen.size() != run.variants.size())
      throw std::invalid_argument(run.route + ": a frame has " + std::to_string(frame.seen.size()) +
                                  " places for " + std::to_string(run.variants.size()) + " variants");
  }
}

// ---- reading

/// One line's fields, one after the other; what is wrong is told with file and line.
class Reader {
 public:
  Reader(std::string name, std::string_view text) : name_(std::move(name)), text_(text) {}

  [[noreturn]] void fail(const std::string& message) const {
    throw RunFileError(name_ + ":" + std::to_string(line_number_) + ": " + message);
  }

  void next_line() {
    line_start_ = at_;
    ++line_number_;
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) fail("the file is cut short here");
    rest_ = text_.substr(at_, end - at_);
    at_ = end + 1;
    fields_left_ = true;
  }
  std::string_view field(const char* what) {
    if (!fields_left_) fail(std::string(what) + " is missing");
    const std::size_t comma = rest_.find(',');
    const std::string_view value = rest_.substr(0, comma);
    fields_left_ = comma != std::string_view::npos;
    rest_ = fields_left_ ? rest_.substr(comma + 1) : std::string_view{};
    return value;
  }
  bool more() const { return fields_left_; }
  void end_of_line() const {
    if (fields_left_) fail("more fields than there should be");
  }
  template <class Number>
  Number number(const char* what) {
    const std::string_view text = field(what);
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc{} || end != text.data() + text.size())
      fail(std::string(what) + " is no number: \"" + std::string(text.substr(0, 40)) + "\"");
    return value;
  }
  Time time(const char* what) { return Time{Duration{number<Duration::rep>(what)}}; }
  Covariance3 matrix(const char* what) {
    Covariance3 value;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) value(row, column) = number<double>(what);
    return value;
  }
  void expect(std::string_view wanted, const char* what) {
    if (const auto found = field(what); found != wanted)
      fail(std::string(what) + " is \"" + std::string(found.substr(0, 40)) + "\", not \"" +
           std::string(wanted) + "\"");
  }
  void whole_line(std::string_view wanted, const char* what) {
    next_line();
    if (rest_ != wanted) fail(std::string("not the ") + what + " that this version writes");
    fields_left_ = false;
  }
  bool observation_left_out() const {
    // A comma follows each field but the line's last.
    const std::size_t other = std::min(rest_.find_first_not_of(','), rest_.size());
    return other >= kFieldsOfObservation || (other == kFieldsOfObservation - 1 && other == rest_.size());
  }
  void skip(std::size_t fields) {
    for (std::size_t i = 0; i < fields; ++i) field("observation");
  }

  std::string_view before_line() const { return text_.substr(0, line_start_); }
  bool at_end() const { return at_ == text_.size(); }

 private:
  std::string name_;
  std::string_view text_;
  std::string_view rest_;
  std::size_t at_ = 0;
  std::size_t line_start_ = 0;
  int line_number_ = 0;
  bool fields_left_ = false;
};

PoseSource read_source(Reader& in) {
  const std::string_view word = in.field("source");
  for (const PoseSource source : kSources)
    if (word == to_string(source)) return source;
  in.fail("no such source: \"" + std::string(word.substr(0, 40)) + "\"");
}

std::optional<Observation> read_observation(Reader& in) {
  if (in.observation_left_out()) {
    in.skip(kFieldsOfObservation);
    return std::nullopt;
  }
  Observation seen;
  seen.captured = in.time("captured_ns of an observation");
  seen.pose.x = in.number<double>("x_m");
  seen.pose.y = in.number<double>("y_m");
  seen.pose.yaw = in.number<double>("yaw_rad");
  seen.covariance = in.matrix("covariance");
  seen.correlated = in.matrix("correlated");
  seen.source = read_source(in);
  seen.camera = in.number<std::size_t>("camera");
  seen.score = in.number<double>("score");
  seen.heading_turns = in.number<int>("heading_turns");
  return seen;
}

std::size_t read_count(Reader& in, std::string_view what) {
  in.next_line();
  in.expect(what, "name of the list");
  const auto count = in.number<std::size_t>("count");
  in.end_of_line();
  if (count > kMostFrames)
    in.fail("count is " + std::to_string(count) + ", allowed 0 to " + std::to_string(kMostFrames));
  return count;
}

void read_head(Reader& in, std::string_view key, ObservedRun& run) {
  in.next_line();
  in.expect(kTitle, "title");
  in.expect(std::to_string(kRunFormat), "format");
  in.expect(fingerprint(key), "key");
  in.end_of_line();
  in.whole_line(kRunColumns, "columns");
  in.next_line();
  run.route = in.field("route");
  run.seed = in.number<std::uint64_t>("seed");
  run.frame_rate_hz = in.number<double>("frame_rate_hz");
  run.width_px = in.number<int>("width_px");
  run.height_px = in.number<int>("height_px");
  in.end_of_line();
  in.next_line();
  in.expect("variants", "name of the list");
  while (in.more()) run.variants.emplace_back(in.field("variant"));
}

void read_odometry(Reader& in, ObservedRun& run) {
  const std::size_t count = read_count(in, "odometry");
  in.whole_line(kOdometryColumns, "columns");
  for (std::size_t i = 0; i < count; ++i) {
    in.next_line();
    BodyVelocity reading;
    reading.at = in.time("at_ns");
    reading.forward = in.number<double>("forward_mps");
    reading.sideways = in.number<double>("sideways_mps");
    reading.yaw_rate = in.number<double>("yaw_rate_radps");
    reading.covariance = in.matrix("covariance");
    in.end_of_line();
    run.odometry.push_back(reading);
  }
}

void read_frames(Reader& in, ObservedRun& run) {
  const std::size_t count = read_count(in, "frames");
  in.whole_line(kFrameColumns, "columns");
  for (std::size_t i = 0; i < count; ++i) {
    in.next_line();
    ObservedFrame frame;
    frame.captured = in.time("captured_ns");
    frame.truth.x = in.number<double>("truth_x_m");
    frame.truth.y = in.number<double>("truth_y_m");
    frame.truth.yaw = in.number<double>("truth_yaw_rad");
    frame.in_view = in.number<int>("in_view") != 0;
    frame.visible = in.number<double>("visible");
    for (std::size_t v = 0; v < run.variants.size(); ++v) frame.seen.push_back(read_observation(in));
    in.end_of_line();
    run.frames.push_back(std::move(frame));
  }
}

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw RunFileError(path.string() + ": cannot be read");
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

}  // namespace

std::size_t variant_index(const ObservedRun& run, std::string_view variant) {
  const auto found = std::find(run.variants.begin(), run.variants.end(), variant);
  if (found == run.variants.end())
    throw std::invalid_argument(run.route + " has no variant called " + std::string(variant));
  return static_cast<std::size_t>(found - run.variants.begin());
}

std::string fingerprint(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211ull;
  }
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
  return digits.data();
}

std::string write_run(const ObservedRun& run, std::string_view key) {
  check_run(run);
  std::string out;
  Line(out).text(kTitle).number(kRunFormat).text(fingerprint(key));
  Line(out).text(kRunColumns);
  Line(out)
      .text(run.route)
      .number(run.seed)
      .number(run.frame_rate_hz)
      .number(run.width_px)
      .number(run.height_px);
  {
    Line line(out);
    line.text("variants");
    for (const std::string& variant : run.variants) line.text(variant);
  }
  Line(out).text("odometry").number(run.odometry.size());
  Line(out).text(kOdometryColumns);
  for (const BodyVelocity& reading : run.odometry) {
    Line line(out);
    line.time(reading.at).number(reading.forward).number(reading.sideways).number(reading.yaw_rate);
    line.matrix(reading.covariance);
  }
  Line(out).text("frames").number(run.frames.size());
  Line(out).text(kFrameColumns);
  for (const ObservedFrame& frame : run.frames) {
    Line line(out);
    line.time(frame.captured).number(frame.truth.x).number(frame.truth.y).number(frame.truth.yaw);
    line.number(frame.in_view ? 1 : 0).number(frame.visible);
    for (const auto& seen : frame.seen) write_observation(line, seen);
  }
  const std::string checksum = fingerprint(out);
  Line(out).text("checksum").text(checksum);
  return out;
}

void save_run(const fs::path& path, const ObservedRun& run, std::string_view key) {
  const std::string text = write_run(run, key);
  fs::path part = path;
  part += ".part";
  {
    std::ofstream file(part, std::ios::binary | std::ios::trunc);
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.close();
    if (!file) throw RunFileError(part.string() + ": cannot be written");
  }
  std::error_code error;
  fs::rename(part, path, error);
  if (error) throw RunFileError(path.string() + ": cannot be written: " + error.message());
}

ObservedRun parse_run(std::string_view text, std::string_view key, const std::string& name) {
  Reader in(name, text);
  ObservedRun run;
  read_head(in, key, run);
  read_odometry(in, run);
  read_frames(in, run);
  in.next_line();
  in.expect("checksum", "end");
  in.expect(fingerprint(in.before_line()), "checksum");
  in.end_of_line();
  if (!in.at_end()) in.fail("more lines than there should be");
  return run;
}

ObservedRun load_run(const fs::path& path, std::string_view key) {
  return parse_run(content_of(path), key, path.string());
}

}  // namespace skylight::service::reproduce
