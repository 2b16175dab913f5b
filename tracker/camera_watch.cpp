#include "tracker/camera_watch.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "tracker/grey.hpp"

namespace skylight {
namespace {

constexpr int kPatch = 21;              // px, side of a feature's picture
constexpr int kReach = 24;              // px around its place that it is looked for
constexpr int kSmall = 480;             // px, the longer side for the whole picture's shift
constexpr std::size_t kLeast = 8;       // features, to tell anything
constexpr double kStays = 0.5;          // px: further than this between looks it is no part of the floor
constexpr double kAgrees = 1.0;         // px from the fit ...
constexpr double kUnlike = 0.1;         // ... and this share of how far most of them moved: the lens bends it
constexpr double kLeastContrast = 4.0;  // grey levels, standard deviation

cv::Mat small_of(const cv::Mat& grey) {
  const double scale = static_cast<double>(kSmall) / std::max(grey.cols, grey.rows);
  cv::Mat small;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  small.convertTo(small, CV_32F);
  // Without the light's own gradient, which stays where it is whatever the camera does.
  cv::Mat light;
  cv::GaussianBlur(small, light, {}, 6.0);
  return small - light;
}

cv::Rect around(const cv::Point2f& at, int half) {
  return {static_cast<int>(std::lround(at.x)) - half, static_cast<int>(std::lround(at.y)) - half,
          2 * half + 1, 2 * half + 1};
}

/// Where the parabola through three neighbours has its top, -0.5 to 0.5 from the middle one.
float vertex(float before, float at, float after) {
  const float bend = before - 2.0F * at + after;
  return bend < 0.0F ? std::clamp(0.5F * (before - after) / bend, -0.5F, 0.5F) : 0.0F;
}

cv::Point2f top_of(const cv::Mat& scores, const cv::Point& at) {
  cv::Point2f out(static_cast<float>(at.x), static_cast<float>(at.y));
  const auto score = [&](int dx, int dy) { return scores.at<float>(at.y + dy, at.x + dx); };
  if (at.x > 0 && at.x + 1 < scores.cols) out.x += vertex(score(-1, 0), score(0, 0), score(1, 0));
  if (at.y > 0 && at.y + 1 < scores.rows) out.y += vertex(score(0, -1), score(0, 0), score(0, 1));
  return out;
}

/// How far a homography turns what lies in the middle of a picture: the rotation nearest to its derivative.
double turn_of(const cv::Mat& fit, const cv::Size& size) {
  const double x = 0.5 * size.width;
  const double y = 0.5 * size.height;
  const auto h = [&](int row, int column) { return fit.at<double>(row, column); };
  const double w = h(2, 0) * x + h(2, 1) * y + h(2, 2);
  const double u = (h(0, 0) * x + h(0, 1) * y + h(0, 2)) / w;
  const double v = (h(1, 0) * x + h(1, 1) * y + h(1, 2)) / w;
  const double du_dx = h(0, 0) - u * h(2, 0);
  const double du_dy = h(0, 1) - u * h(2, 1);
  const double dv_dx = h(1, 0) - v * h(2, 0);
  const double dv_dy = h(1, 1) - v * h(2, 1);
  return std::atan2((dv_dx - du_dy) * std::copysign(1.0, w), (du_dx + dv_dy) * std::copysign(1.0, w));
}

}  // namespace

std::string check(const CameraWatchConfig& c) {
  std::ostringstream text;
  const auto range = [&text](const char* field, double value, double min, double max) {
    if (text.tellp() == 0 && !(value >= min && value <= max))
      text << field << " is " << value << ", allowed " << min << " to " << max;
  };
  range("interval_s", c.interval_s, 0.0, 60.0);
  range("learn_s", c.learn_s, 0.0, 60.0);
  range("settle_s", c.settle_s, 0.0, 60.0);
  range("features", c.features, 9, 1024);
  range("least_shift_px", c.least_shift_px, 0.1, 1000.0);
  range("least_match", c.least_match, 0.3, 1.0);
  range("least_share", c.least_share, 0.1, 1.0);
  return text.str();
}

std::string_view to_string(CameraHold hold) {
  switch (hold) {
    case CameraHold::learning:
      return "learning";
    case CameraHold::steady:
      return "steady";
    case CameraHold::moved:
      return "moved";
    case CameraHold::blind:
      return "blind";
  }
  return "blind";
}

CameraWatch::CameraWatch(const CameraWatchConfig& config) : config_(config) {
  if (const std::string wrong = check(config); !wrong.empty())
    throw std::invalid_argument("camera watch: " + wrong);
}

void CameraWatch::relearn() {
  features_.clear();
  small_reference_.release();
  learning_since_.reset();
  last_look_.reset();
  candidate_.reset();
  report_ = {};
}

const CameraWatchReport& CameraWatch::look(const Frame& frame) {
  if (last_look_ && frame.captured - *last_look_ < from_seconds(config_.interval_s)) return report_;
  const cv::Mat grey = grey_of(frame.image);
  if (grey.size() != size_) relearn();
  size_ = grey.size();
  last_look_ = frame.captured;
  if (report_.hold == CameraHold::learning) {
    learn(grey, frame.captured);
  } else {
    judge(grey, frame.captured);
  }
  return report_;
}

// One corner for each part of the picture, so that all of it has a vote.
void CameraWatch::learn(const cv::Mat& grey, Time now) {
  if (learning_since_) {
    thin_out(grey);
    if (features_.size() >= kLeast) {
      if (now - *learning_since_ < from_seconds(config_.learn_s)) return;
      report_ = {
          .hold = CameraHold::steady, .since = now, .features = features_.size(), .agree = features_.size()};
      return;
    }
  }
  features_.clear();
  learning_since_ = now;
  small_reference_ = small_of(grey);
  const int side = static_cast<int>(std::sqrt(config_.features));
  const int margin = kPatch / 2 + 1;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const cv::Rect cell(cv::Point(grey.cols * column / side, grey.rows * row / side),
                          cv::Point(grey.cols * (column + 1) / side, grey.rows * (row + 1) / side));
      std::vector<cv::Point2f> corner;
      cv::goodFeaturesToTrack(grey(cell), corner, 1, 0.01, 1.0);
      if (corner.empty()) continue;
      const cv::Point2f at(std::round(corner[0].x) + static_cast<float>(cell.x),
                           std::round(corner[0].y) + static_cast<float>(cell.y));
      const cv::Rect box = around(at, kPatch / 2);
      const cv::Rect inside(margin, margin, grey.cols - 2 * margin, grey.rows - 2 * margin);
      if ((box & inside) != box) continue;
      cv::Scalar mean;
      cv::Scalar spread;
      cv::meanStdDev(grey(box), mean, spread);
      if (spread[0] >= kLeastContrast) features_.push_back({at, grey(box).clone()});
    }
  }
}

void CameraWatch::thin_out(const cv::Mat& grey) {
  std::erase_if(features_, [&](const Feature& feature) {
    const auto is = find(grey, feature, {});
    return !is || cv::norm(*is - feature.at) > kStays;
  });
}

std::optional<cv::Point2f> CameraWatch::find(const cv::Mat& grey, const Feature& feature,
                                             const cv::Point2f& offset) const {
  const cv::Rect window = around(feature.at + offset, kPatch / 2 + kReach) & cv::Rect({}, grey.size());
  if (window.width < kPatch || window.height < kPatch) return std::nullopt;
  cv::Mat scores;
  cv::matchTemplate(grey(window), feature.picture, scores, cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point at;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &at);
  if (!(best >= config_.least_match)) return std::nullopt;
  return top_of(scores, at) +
         cv::Point2f(static_cast<float>(window.x + kPatch / 2), static_cast<float>(window.y + kPatch / 2));
}

std::vector<CameraWatch::Match> CameraWatch::matches(const cv::Mat& grey, const cv::Point2f& offset) const {
  std::vector<Match> out;
  for (const Feature& feature : features_) {
    if (const auto is = find(grey, feature, offset)) out.push_back({feature.at, *is});
  }
  return out;
}

/// Of the picture's middle: where it agrees best with what was learnt.
cv::Point2f CameraWatch::whole_shift(const cv::Mat& grey) const {
  const cv::Mat small = small_of(grey);
  const cv::Rect middle(small.cols / 5, small.rows / 5, small.cols * 3 / 5, small.rows * 3 / 5);
  cv::Mat scores;
  cv::matchTemplate(small, small_reference_(middle), scores, cv::TM_CCOEFF_NORMED);
  cv::Point at;
  cv::minMaxLoc(scores, nullptr, nullptr, nullptr, &at);
  const float scale = static_cast<float>(grey.cols) / static_cast<float>(small.cols);
  return scale * (top_of(scores, at) - cv::Point2f(middle.tl()));
}

void CameraWatch::judge(const cv::Mat& grey, Time now) {
  const auto needed = static_cast<std::size_t>(
      std::ceil(std::max<double>(kLeast - 1, config_.least_share * static_cast<double>(features_.size()))));
  cv::Point2f offset;
  std::vector<Match> seen = matches(grey, offset);
  if (seen.size() < needed) {
    offset = whole_shift(grey);
    seen = matches(grey, offset);
  }
  report_.agree = 0;
  report_.shift_px = report_.turn_rad = 0.0;
  if (seen.size() < needed) return believe(CameraHold::blind, now);

  std::vector<cv::Point2f> was;
  std::vector<cv::Point2f> is;
  for (const Match& match : seen) {
    was.push_back(match.was);
    is.push_back(match.is);
  }
  std::vector<double> ways;
  for (std::size_t i = 0; i < was.size(); ++i) ways.push_back(cv::norm(is[i] - was[i]));
  std::nth_element(ways.begin(), ways.begin() + static_cast<std::ptrdiff_t>(ways.size() / 2), ways.end());
  std::vector<unsigned char> agrees;
  const cv::Mat fit =
      cv::findHomography(was, is, cv::RANSAC, kAgrees + kUnlike * ways[ways.size() / 2], agrees);
  report_.agree = static_cast<std::size_t>(std::count(agrees.begin(), agrees.end(), 1));
  if (fit.empty() || report_.agree < needed) return believe(CameraHold::blind, now);
  std::vector<cv::Point2f> moved;
  cv::perspectiveTransform(was, moved, fit);
  for (std::size_t i = 0; i < was.size(); ++i) {
    if (agrees[i] != 0) report_.shift_px += cv::norm(moved[i] - was[i]) / static_cast<double>(report_.agree);
  }
  report_.turn_rad = turn_of(fit, grey.size());
  believe(report_.shift_px > config_.least_shift_px ? CameraHold::moved : CameraHold::steady, now);
}

// A flash or somebody's head before the lens is over soon: what is told changes once looks have agreed for a
// while.
void CameraWatch::believe(CameraHold seen, Time now) {
  if (seen == report_.hold) {
    candidate_.reset();
    return;
  }
  if (candidate_ != seen) {
    candidate_ = seen;
    candidate_since_ = now;
  }
  if (now - candidate_since_ < from_seconds(config_.settle_s)) return;
  report_.hold = seen;
  report_.since = candidate_since_;
  candidate_.reset();
}

}  // namespace skylight
