#include "sim/render/artwork.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "sim/render/tags.hpp"
#include "sim/render/textures.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {
namespace {

constexpr double kPrintResolution = 0.001;  ///< metres per pixel of drawn pictures
constexpr double kLidarMargin = 0.003;      ///< m around the tower that no picture covers
constexpr double kPixelsPerCell = 10.0;     ///< of a tag's print, at least
constexpr double kSearchStep = 0.001;       ///< m between the places that are tried for a tag
constexpr double kSlack = 1e-9;             ///< m; for sums of decimal fractions

std::string path_of(std::size_t robot, const char* part) {
  return "robots[" + std::to_string(robot) + "]." + part;
}

/// Metres for messages: to a tenth of a millimetre, without trailing zeros.
std::string metres(double value) {
  std::string text = std::to_string(std::round(value * 1e4) / 1e4);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text + " m";
}

Eigen::Vector2d plate_size(const RobotModel& model) {
  return model.plate.max - model.plate.min;  // forward, left
}

/// A picture without anything on it that covers the plate.
RobotPicture bare_plate(const RobotModel& model, double metres_per_pixel) {
  const Eigen::Vector2d plate = plate_size(model);
  RobotPicture picture;
  const int columns = std::max(2, static_cast<int>(std::ceil(plate.y() / metres_per_pixel - 1e-6)));
  picture.metres_per_pixel = plate.y() / columns;
  const int rows = static_cast<int>(std::lround(plate.x() / picture.metres_per_pixel));
  picture.image = cv::Mat(rows, columns, CV_8UC4, cv::Scalar::all(0));
  picture.surface_height_m = model.plate_height_m;
  picture.reference_point_m = -0.5 * (model.plate.min + model.plate.max);
  return picture;
}

RobotPicture without_tag(const Scenario& scenario, std::size_t robot) {
  const RobotSpec& spec = scenario.robots.at(robot);
  const RobotModel& model = robot_model(spec.model);
  RobotPicture picture = bare_plate(model, kPrintResolution);
  if (!spec.picture.enabled) return picture;
  const Eigen::Vector2d plate = plate_size(model);
  const std::string key = path_of(robot, "picture");
  const double width = spec.picture.width_m.value_or(plate.y());
  if (spec.picture.file.empty()) {
    const std::uint64_t seed = spec.picture.seed != 0 ? spec.picture.seed : robot + 1;
    picture.image = draw_robot_picture(seed, static_cast<int>(std::lround(width / kPrintResolution)));
  } else {
    picture.image = load_picture(scenario.folder, spec.picture.file, key + ".file");
  }
  if (picture.image.channels() == 3) cv::cvtColor(picture.image, picture.image, cv::COLOR_BGR2BGRA);
  picture.metres_per_pixel = width / picture.image.cols;
  const double length = picture.image.rows * picture.metres_per_pixel;
  if (length > plate.x() + 1e-6 || width > plate.y() + 1e-6) {
    throw std::invalid_argument(key + ": " + metres(length) + " long and " + metres(width) +
                                " wide does not fit the plate (" + metres(plate.x()) + " by " +
                                metres(plate.y()) + ")");
  }
  return picture;
}

/// Calls draw(pixel, x, y) for each pixel with its place from the plate's middle, robot axes.
void for_each_pixel(RobotPicture& picture, const std::function<void(cv::Vec4b&, double, double)>& draw) {
  const cv::Mat& image = picture.image;
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      draw(picture.image.at<cv::Vec4b>(r, c), (0.5 * (image.rows - 1) - r) * picture.metres_per_pixel,
           (0.5 * (image.cols - 1) - c) * picture.metres_per_pixel);
    }
  }
}

/// Makes the picture transparent where the lidar tower stands.
void cut_out_lidar(RobotPicture& picture, const RobotModel& model) {
  if (model.lidar_radius_m <= 0.0) return;
  const Eigen::Vector2d at = model.lidar_m + picture.reference_point_m;  // from the plate's middle
  const double reach = model.lidar_radius_m + kLidarMargin;
  for_each_pixel(picture, [&](cv::Vec4b& pixel, double x, double y) {
    if (std::hypot(x - at.x(), y - at.y()) <= reach) pixel[3] = 0;
  });
}

/// Places on a plate for a square of this edge, turned by an angle.
class Room {
 public:
  Room(const RobotModel& model, double yaw)
      : half_(0.5 * plate_size(model)),
        lidar_(model.lidar_m - 0.5 * (model.plate.min + model.plate.max)),
        reach_(model.lidar_radius_m > 0.0 ? model.lidar_radius_m + kLidarMargin : 0.0),
        turn_(-yaw),
        extent_(0.5 * (std::abs(std::cos(yaw)) + std::abs(std::sin(yaw)))) {}

  bool on_plate(const Eigen::Vector2d& at, double edge) const {
    return (at.cwiseAbs().array() + extent_ * edge <= half_.array() + kSlack).all();
  }
  bool beside_lidar(const Eigen::Vector2d& at, double edge) const {
    const Eigen::Vector2d lidar = turn_ * (lidar_ - at);  // in the square's own axes
    const Eigen::Vector2d beyond = (lidar.cwiseAbs().array() - 0.5 * edge).matrix().cwiseMax(0.0);
    return reach_ <= 0.0 || beyond.norm() >= reach_ - kSlack;
  }
  /// The free place nearest to the plate's middle; of several the one farthest back, then to the right.
  std::optional<Eigen::Vector2d> find(double edge) const {
    const Eigen::Vector2d most = half_.array() - extent_ * edge;
    if ((most.array() < -kSlack).any()) return std::nullopt;
    std::optional<Eigen::Vector2d> best;
    for (const double x : places(most.x())) {
      for (const double y : places(most.y())) {
        const Eigen::Vector2d at(x, y);
        if (best && at.norm() >= best->norm() - kSlack) continue;
        if (beside_lidar(at, edge)) best = at;
      }
    }
    return best;
  }
  /// Of a square that fits somewhere, to a millimetre.
  double largest() const {
    double edge = 0.0;
    while (find(edge + kSearchStep)) edge += kSearchStep;
    return edge;
  }

 private:
  /// From -most to most, both and 0 among them.
  static std::vector<double> places(double most) {
    const int steps = static_cast<int>(std::ceil(std::max(0.0, most) / kSearchStep));
    std::vector<double> result;
    for (int i = -steps; i <= steps; ++i)
      result.push_back(std::clamp(i * kSearchStep, -std::max(0.0, most), std::max(0.0, most)));
    return result;
  }

  Eigen::Vector2d half_;
  Eigen::Vector2d lidar_;
  double reach_;
  Eigen::Rotation2Dd turn_;
  double extent_;  ///< half the extent along the plate's axes of a turned square of edge 1
};

TagPlace place_tag(const RobotSpec& spec, const TagPattern& pattern, const std::string& key) {
  const TagSpec& tag = *spec.tag;
  TagPlace place;
  place.yaw = tag.yaw_deg * std::numbers::pi / 180.0;
  const double printed_per_size = 1.0 * pattern.cells.cols / pattern.border_cells;
  place.printed_m = tag.size_m * printed_per_size;
  const RobotModel& model = robot_model(spec.model);
  const Room room(model, place.yaw);
  const bool is_given = tag.x_m || tag.y_m;
  const std::optional<Eigen::Vector2d> at =
      is_given ? Eigen::Vector2d(tag.x_m.value_or(0.0), tag.y_m.value_or(0.0)) : room.find(place.printed_m);
  const bool fits = at && room.on_plate(*at, place.printed_m);
  if (!fits || !room.beside_lidar(*at, place.printed_m)) {
    throw std::invalid_argument(
        key + ": a tag of " + metres(tag.size_m) + ", " + metres(place.printed_m) + " with its rim, " +
        (is_given && fits ? "lies under the lidar there"
                          : (is_given ? "sticks out over the plate there" : "has no room on the plate")) +
        " (size_m at most " + metres(room.largest() / printed_per_size) +
        " where x_m and y_m are left out; plate " + metres(plate_size(model).x()) + " by " +
        metres(plate_size(model).y()) + ")");
  }
  place.x_m = at->x();
  place.y_m = at->y();
  return place;
}

/// The picture as a part of one that covers the plate, with pixels of at most this size.
RobotPicture on_plate(const RobotPicture& picture, const RobotModel& model, double metres_per_pixel) {
  RobotPicture whole = bare_plate(model, std::min(metres_per_pixel, picture.metres_per_pixel));
  const double scale = picture.metres_per_pixel / whole.metres_per_pixel;
  // As many pixels beyond it on either side, so that its middle stays where it is.
  const auto length = [&](int pixels, int all) {
    const int wanted = static_cast<int>(std::lround(pixels * scale));
    return std::min(all, wanted + (all - wanted) % 2);
  };
  const cv::Size size(length(picture.image.cols, whole.image.cols),
                      length(picture.image.rows, whole.image.rows));
  const cv::Rect part((whole.image.cols - size.width) / 2, (whole.image.rows - size.height) / 2, size.width,
                      size.height);
  cv::Mat scaled;
  cv::resize(picture.image, scaled, size, 0, 0, cv::INTER_LINEAR);
  scaled.copyTo(whole.image(part));
  return whole;
}

/// Prints grey levels on the picture over a square at this place: `grey(right, down)`, each from -0.5 to 0.5
/// of the square's edge; the edges softened by 16 samples a pixel.
void print_square(RobotPicture& picture, const TagPlace& place, double edge,
                  const std::function<double(double, double)>& grey) {
  const double cosine = std::cos(place.yaw);
  const double sine = std::sin(place.yaw);
  const double reach = 0.75 * edge + picture.metres_per_pixel;
  for_each_pixel(picture, [&](cv::Vec4b& pixel, double x, double y) {
    if (std::abs(x - place.x_m) > reach || std::abs(y - place.y_m) > reach) return;
    double sum = 0.0;
    int covered = 0;
    for (int i = 0; i < 16; ++i) {
      const double dx = x - place.x_m + ((i / 4 + 0.5) / 4.0 - 0.5) * picture.metres_per_pixel;
      const double dy = y - place.y_m + ((i % 4 + 0.5) / 4.0 - 0.5) * picture.metres_per_pixel;
      const double right = (dx * sine - dy * cosine) / edge;
      const double down = -(dx * cosine + dy * sine) / edge;
      if (std::max(std::abs(right), std::abs(down)) >= 0.5) continue;
      sum += grey(right, down);
      ++covered;
    }
    if (covered == 0) return;
    // Over what was printed before; where nothing was, the edge is as see-through as it is uncovered.
    const double share = pixel[3] == 0 ? 1.0 : covered / 16.0;
    for (int k = 0; k < 3; ++k)
      pixel[k] = cv::saturate_cast<std::uint8_t>(share * sum / covered + (1.0 - share) * pixel[k]);
    pixel[3] = std::max(pixel[3], cv::saturate_cast<std::uint8_t>(255.0 * covered / 16.0));
  });
}

void print_tag(RobotPicture& picture, const TagPlace& place, const cv::Mat& cells) {
  print_square(picture, place, place.printed_m, [&](double right, double down) {
    const int column = std::clamp(static_cast<int>((right + 0.5) * cells.cols), 0, cells.cols - 1);
    const int row = std::clamp(static_cast<int>((down + 0.5) * cells.rows), 0, cells.rows - 1);
    return static_cast<double>(cells.at<std::uint8_t>(row, column));
  });
}

}  // namespace

std::optional<TagPlace> tag_place(const Scenario& scenario, std::size_t robot) {
  const RobotSpec& spec = scenario.robots.at(robot);
  if (!spec.tag) return std::nullopt;
  const std::string key = path_of(robot, "tag");
  return place_tag(spec, tag_pattern(*spec.tag, key), key);
}

RobotPicture make_picture(const Scenario& scenario, std::size_t robot) {
  const RobotSpec& spec = scenario.robots.at(robot);
  const RobotModel& model = robot_model(spec.model);
  RobotPicture picture = without_tag(scenario, robot);
  if (spec.tag) {
    const std::string key = path_of(robot, "tag");
    const TagPattern pattern = tag_pattern(*spec.tag, key);
    const TagPlace place = place_tag(spec, pattern, key);
    picture = on_plate(picture, model, spec.tag->size_m / pattern.border_cells / kPixelsPerCell);
    print_tag(picture, place, pattern.cells);
  }
  cut_out_lidar(picture, model);
  return picture;
}

RobotPicture make_covered(const Scenario& scenario, std::size_t robot, bool tag_only) {
  constexpr double kCard = 214.0;  // grey
  constexpr double kCloth = 92.0;
  constexpr double kWeave = 14.0;        // of the cloth, peak to peak
  constexpr double kWovenEvery = 0.024;  // m
  const RobotModel& model = robot_model(scenario.robots.at(robot).model);
  const std::optional<TagPlace> place = tag_place(scenario, robot);
  RobotPicture picture = make_picture(scenario, robot);
  if (tag_only && place) {
    print_square(picture, *place, place->printed_m, [](double, double) { return kCard; });
  } else if (!tag_only) {
    picture = bare_plate(model, kPrintResolution);
    const double wave = 2.0 * std::numbers::pi / kWovenEvery;
    for_each_pixel(picture, [&](cv::Vec4b& pixel, double x, double y) {
      const double grey = kCloth + 0.25 * kWeave * (std::sin(wave * (x + y)) + std::sin(wave * (x - y)));
      pixel = cv::Vec4b::all(cv::saturate_cast<std::uint8_t>(grey));
      pixel[3] = 255;
    });
  }
  cut_out_lidar(picture, model);
  return picture;
}

RobotLook make_look(const RobotSpec& robot, const RobotPicture& picture) {
  const RobotModel& model = robot_model(robot.model);
  Bgr plate_color = Bgr::Zero();
  for (const Solid& solid : model.solids) {
    if (solid.carries_picture) plate_color = bgr(solid.top_rgb);
  }
  cv::Mat opaque(picture.image.size(), CV_8UC3);
  for (int r = 0; r < opaque.rows; ++r) {
    for (int c = 0; c < opaque.cols; ++c) {
      const auto& from = picture.image.at<cv::Vec4b>(r, c);
      const float alpha = static_cast<float>(from[3]) / 255.0F;
      for (int k = 0; k < 3; ++k) {
        opaque.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(alpha * static_cast<float>(from[k]) +
                                                                        (1.0F - alpha) * plate_color[k]);
      }
    }
  }
  return {&model, Texture(opaque, false), picture.metres_per_pixel};
}

}  // namespace skylight::sim
