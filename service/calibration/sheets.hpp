// What lies on the floor to calibrate by, as people describe it: tags each for itself, sheets with several
// tags, boards. The command line and the API read the same descriptions.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/extrinsics.hpp"
#include "service/calibration/tags.hpp"
#include "settings/fields.hpp"

namespace skylight::service {

/// A tag: where its middle lies, on its sheet or in `map`, and where its right side points.
struct SheetTag {
  std::string family = "36h11";  ///< 36h11, 25h9, 16h5, or a dictionary of dictionary_names()
  int id = 0;                    ///< 0 to 100000
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_deg = 0.0;
  double size_m = 0.0;  ///< outer edge of the black border, 0.005 to 10
};

/// Where a sheet lies in `map`, and how well that was measured.
struct SheetPlace {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_deg = 0.0;
  double sigma_m = 0.002;
  double sigma_deg = 0.2;
};

/// What lies there as one piece. Without a place the cameras that see it find it out.
struct FloorSheet {
  std::string name{};
  std::optional<SheetPlace> place{};
  std::vector<SheetTag> tags{};
  std::optional<std::string> board{};  ///< its middle is the sheet's origin
};

/// Exact, because the map is where the board lies: that it was laid down askew is nobody's error.
struct FloorBoard {
  std::string board{};
  SheetPlace at{};
};

void describe(settings::Fields& fields, SheetTag& tag);
void describe(settings::Fields& fields, SheetPlace& place);
void describe(settings::Fields& fields, FloorSheet& sheet);

struct FloorDescription {
  std::vector<SheetTag> tags{};  ///< each lies for itself
  double place_sigma_m = 0.002;  ///< how well the places of those were measured, 0 to 1
  std::vector<FloorSheet> sheets{};
  std::optional<FloorBoard> board{};
};

class Floor {
 public:
  /// Throws std::invalid_argument naming what is wrong: an unknown family, a tag that is there twice, a board
  /// whose yaw cannot be told.
  explicit Floor(const FloorDescription& description);

  /// For calibrate_extrinsics(). The first sheet is `map` itself, for points that are given by their pixels.
  const std::vector<calibration::Sheet>& sheets() const { return sheets_; }

  /// Adds to `camera` what of the floor a picture shows. `name`: of the picture, for people. Gives a line for
  /// each board that was not found, with the reason.
  std::vector<std::string> look(const std::string& name, const cv::Mat& picture,
                                calibration::SeeingCamera& camera);

 private:
  struct Contents {
    std::map<std::pair<std::string, int>, SheetTag> tags;  ///< by dictionary and id
    std::optional<calibration::Board> board;
  };

  void add(calibration::Sheet sheet, Contents contents);
  void add_tag(Contents& contents, const SheetTag& tag) const;
  void add_tag_points(std::size_t sheet, const SheetTag& tag, const calibration::TagSighting& seen,
                      calibration::SeeingCamera& camera);
  std::string add_board_points(const std::string& name, std::size_t sheet, const cv::Mat& picture,
                               calibration::SeeingCamera& camera);

  std::vector<calibration::Sheet> sheets_;
  std::vector<Contents> contents_;  ///< by sheet
  int group_ = 0;                   ///< the newest tag's or board's number
};

/// calibrate_extrinsics() of what cameras see of a floor, without a word about places that nobody used.
calibration::ExtrinsicsResult calibrate_on(const Floor& floor,
                                           std::vector<calibration::SeeingCamera> cameras);

}  // namespace skylight::service
