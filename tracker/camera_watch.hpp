// Whether a camera still hangs as it did when it was calibrated: small pictures of the floor at fixed places
// are looked for around those places. Robots, people and shadows take some of them away or make some of them
// jump; a camera that was bumped moves all of them together.
//
// At each look every feature that is seen again (normalised cross-correlation) votes with its displacement,
// found to a fraction of a pixel; a homography, for the picture of a plane changes by one (but for the lens),
// is fitted that most agree with (RANSAC). Where hardly any is seen where it was, the shift of the picture's
// middle is found first, up to a fifth of the picture: turned by far is told from covered.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "tracker/types.hpp"

namespace skylight {

struct CameraWatchConfig {
  double interval_s = 0.5;      ///< between looks, 0 to 60
  double learn_s = 1.0;         ///< over which features have to stay where they are, 0 to 60
  double settle_s = 1.5;        ///< so long looks must agree until they are believed, 0 to 60
  int features = 64;            ///< at most, spread over the picture, 9 to 1024
  double least_shift_px = 0.8;  ///< moved: features moved by more than this, 0.1 to 1000
  double least_match = 0.75;    ///< correlation at which a feature is seen again, 0.3 to 1
  double least_share = 0.4;     ///< of the features that have to agree, else the camera is blind, 0.1 to 1

  friend bool operator==(const CameraWatchConfig&, const CameraWatchConfig&) = default;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const CameraWatchConfig& config);

enum class CameraHold : std::uint8_t {
  learning,  ///< not enough seen yet, or nothing on the floor to hold on to
  steady,    ///< the floor is where it was
  moved,     ///< most of the floor agrees that it is elsewhere
  blind,     ///< too little of it is seen to tell: dark, or covered
};
std::string_view to_string(CameraHold hold);

struct CameraWatchReport {
  CameraHold hold = CameraHold::learning;
  Time since{};              ///< the look from which this was so
  std::size_t features = 0;  ///< that are looked for
  std::size_t agree = 0;     ///< of them at the newest look
  double shift_px = 0.0;     ///< mean length of their displacements, by the fit
  double turn_rad = 0.0;     ///< of the picture's content, clockwise as seen (x right, y down)
};

class CameraWatch {
 public:
  /// Throws std::invalid_argument with check()'s message.
  explicit CameraWatch(const CameraWatchConfig& config = {});

  /// Frames of one camera in the order of capture; those that come before the next look is due cost nothing.
  /// A frame of another size than before begins anew.
  const CameraWatchReport& look(const Frame& frame);
  const CameraWatchReport& report() const { return report_; }

  /// What is seen from now on is right: after a new calibration.
  void relearn();

 private:
  struct Feature {
    cv::Point2f at;  ///< its middle
    cv::Mat picture;
  };
  struct Match {
    cv::Point2f was, is;
  };

  void learn(const cv::Mat& grey, Time now);
  void thin_out(const cv::Mat& grey);
  void judge(const cv::Mat& grey, Time now);
  std::vector<Match> matches(const cv::Mat& grey, const cv::Point2f& offset) const;
  std::optional<cv::Point2f> find(const cv::Mat& grey, const Feature& feature,
                                  const cv::Point2f& offset) const;
  cv::Point2f whole_shift(const cv::Mat& grey) const;
  void believe(CameraHold seen, Time now);

  CameraWatchConfig config_;
  CameraWatchReport report_;
  std::vector<Feature> features_;
  cv::Size size_;
  cv::Mat small_reference_;
  std::optional<Time> learning_since_, last_look_;
  std::optional<CameraHold> candidate_;
  Time candidate_since_{};
};

}  // namespace skylight
