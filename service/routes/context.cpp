#include "service/routes/context.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <regex>

#include "service/calibration/desk.hpp"

namespace skylight::service {
namespace {

constexpr double kLatestUnixSeconds = 7'258'118'400.0;  // 2200-01-01
constexpr const char* kUnixSeconds = "Unix seconds, 0 to 7258118400";

[[noreturn]] void refuse_parameter(const std::string& name, const std::string& value,
                                   const std::string& allowed) {
  throw http::Problem(400, "Bad query parameter", name + " is '" + value + "', allowed: " + allowed);
}

// As JSON writes numbers: no space, no sign before a plus, no hexadecimal, no infinity.
std::optional<double> parse_number(const std::string& text) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Time> parse_time(const std::string& text) {
  const auto seconds = parse_number(text);
  if (!seconds || *seconds < 0.0 || *seconds > kLatestUnixSeconds) return std::nullopt;
  return from_unix_seconds(*seconds);
}

}  // namespace

Appearances AppearanceStore::all() const {
  const std::lock_guard lock(mutex_);
  return appearances_;
}

std::shared_ptr<const Appearance> AppearanceStore::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto at = appearances_.find(id);
  return at == appearances_.end() ? nullptr : at->second;
}

bool AppearanceStore::add(std::shared_ptr<const Appearance> appearance) {
  const std::lock_guard lock(mutex_);
  return appearances_.emplace(appearance->id(), appearance).second;
}

void AppearanceStore::replace(Appearances appearances) {
  const std::lock_guard lock(mutex_);
  appearances_ = std::move(appearances);
}

http::Reply json_reply(const Json& body, int status) {
  return {.status = status, .body = body.dump() + "\n"};
}

std::optional<double> query_number(const http::Request& request, const std::string& name) {
  const std::string* text = request.query_value(name);
  if (text == nullptr) return std::nullopt;
  const auto value = parse_number(*text);
  if (!value) refuse_parameter(name, *text, "a finite number");
  return value;
}

std::optional<std::int64_t> query_whole(const http::Request& request, const std::string& name,
                                        std::int64_t min, std::int64_t max) {
  const auto value = query_number(request, name);
  if (!value) return std::nullopt;
  if (*value != std::floor(*value) || *value < static_cast<double>(min) || *value > static_cast<double>(max))
    refuse_parameter(name, *request.query_value(name),
                     "a whole number from " + std::to_string(min) + " to " + std::to_string(max));
  return static_cast<std::int64_t>(*value);
}

std::optional<std::string> query_text(const http::Request& request, const std::string& name,
                                      const std::string& pattern, const std::string& allowed) {
  const std::string* text = request.query_value(name);
  if (text == nullptr) return std::nullopt;
  if (!std::regex_match(*text, std::regex(pattern))) refuse_parameter(name, *text, allowed);
  return *text;
}

std::optional<Time> query_time(const http::Request& request, const std::string& name) {
  const std::string* text = request.query_value(name);
  if (text == nullptr) return std::nullopt;
  const auto time = parse_time(*text);
  if (!time) refuse_parameter(name, *text, kUnixSeconds);
  return time;
}

AskedInstant query_instant(const http::Request& request, const std::string& name) {
  const std::string* text = request.query_value(name);
  if (text == nullptr) return {};
  if (*text == "now") return {.now = true};
  const auto time = parse_time(*text);
  if (!time) refuse_parameter(name, *text, std::string("now, or ") + kUnixSeconds);
  return {.at = time};
}

std::optional<PoseKind> query_kind(const http::Request& request) {
  const std::string* text = request.query_value("kind");
  if (text == nullptr) return std::nullopt;
  const auto kind = pose_kind_from_string(*text);
  if (!kind) refuse_parameter("kind", *text, "measured, filtered, smoothed, predicted");
  return kind;
}

void check_query(const http::Request& request, std::initializer_list<std::string_view> known) {
  for (const auto& [name, value] : request.query) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      std::string allowed;
      for (const std::string_view k : known) allowed += (allowed.empty() ? "" : ", ") + std::string(k);
      throw http::Problem(
          400, "Unknown query parameter",
          "'" + name + "' is no parameter here, allowed: " + (allowed.empty() ? "none" : allowed));
    }
    if (request.query.count(name) > 1)
      throw http::Problem(400, "Bad query parameter", name + " is given more than once");
  }
}

const RobotSnapshot& robot_of(const http::Request& request, const Snapshot& snapshot) {
  const std::string& id = request.path_param("id");
  const RobotSnapshot* robot = snapshot.robot(id);
  if (robot == nullptr) throw http::Problem(404, "No such robot", "there is no robot '" + id + "'");
  return *robot;
}

const CameraSnapshot& camera_of(const http::Request& request, const Snapshot& snapshot) {
  const std::string& id = request.path_param("id");
  const CameraSnapshot* camera = snapshot.camera(id);
  if (camera == nullptr) throw http::Problem(404, "No such camera", "there is no camera '" + id + "'");
  return *camera;
}

void change_calibration(const std::function<void()>& change, int changed) {
  try {
    change();
  } catch (const std::invalid_argument& error) {
    throw http::Problem(422, "The calibration is refused", std::string("body: ") + error.what());
  } catch (const NoSuchCalibration& error) {
    throw http::Problem(404, "No such calibration", error.what());
  } catch (const CalibrationChanged& error) {
    throw http::Problem(changed, "The calibration has changed", error.what());
  } catch (const CalibrationNotStored& error) {
    throw http::Problem(500, "The calibration is not stored", error.what());
  }
}

Json page_of(const http::Request& request, const std::vector<Json>& items) {
  const auto limit = static_cast<std::size_t>(query_whole(request, "limit", 1, 1000).value_or(100));
  const auto offset = static_cast<std::size_t>(query_whole(request, "offset", 0, 1'000'000'000).value_or(0));
  Json page = Json::array();
  for (std::size_t i = offset; i < std::min(items.size(), offset + limit); ++i) page.push_back(items[i]);
  return {{"items", std::move(page)}, {"total", items.size()}, {"limit", limit}, {"offset", offset}};
}

settings::Document body_document(const http::Request& request) {
  try {
    return settings::parse(request.body, "body");
  } catch (const settings::Error& error) {
    throw http::Problem(400, "The body is not JSON", error.what());
  }
}

void refuse_body(const settings::Error& error) {
  throw http::Problem(422, "The body is refused", error.what());
}

void change_tracker(const RouteContext& context, const std::function<void(Tracker&)>& change) {
  try {
    context.pipeline.change(change);
  } catch (const std::invalid_argument& e) {
    throw http::Problem(422, "The change is refused", e.what());
  }
}

}  // namespace skylight::service
