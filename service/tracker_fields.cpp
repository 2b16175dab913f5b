// How the tracker's own settings read in a configuration: keys, ranges, units, and what they are for.
#include <algorithm>

#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight {
using settings::Fields;

void describe(Fields& fields, Intrinsics& intrinsics) {
  fields.about("Lens and sensor, in pixels; the centre of the top-left pixel is (0, 0), as in OpenCV.");
  const auto length = [](std::string_view help) {
    return settings::Rules{.min = 1e-3, .max = 1e6, .unit = "px", .required = true, .help = help};
  };
  const auto side = [](std::string_view help) {
    return settings::Rules{
        .min = 1, .max = Intrinsics::kLargestSide, .unit = "px", .required = true, .help = help};
  };
  const auto centre = [](std::string_view help) {
    return settings::Rules{
        .min = -0.5, .max = Intrinsics::kLargestSide, .unit = "px", .required = true, .help = help};
  };
  fields.field("width_px", intrinsics.width_px, side("Width of the picture."));
  fields.field("height_px", intrinsics.height_px, side("Height of the picture."));
  fields.field("fx_px", intrinsics.fx_px, length("Focal length, horizontal."));
  fields.field("fy_px", intrinsics.fy_px, length("Focal length, vertical."));
  fields.field("cx_px", intrinsics.cx_px, centre("Column of the optical axis."));
  fields.field("cy_px", intrinsics.cy_px, centre("Row of the optical axis."));
  fields.choice("lens", intrinsics.lens,
                {{"brown_conrady", LensModel::brown_conrady}, {"kannala_brandt", LensModel::kannala_brandt}},
                {.help = "Model of the distortion; kannala_brandt is OpenCV's fisheye."});
  std::vector<double> distortion(intrinsics.distortion.begin(), intrinsics.distortion.end());
  fields.field("distortion", distortion,
               {.max_items = 5,
                .help = "brown_conrady: k1 k2 p1 p2 k3; kannala_brandt: k1 k2 k3 k4. Those left out are 0."});
  intrinsics.distortion.fill(0.0);
  std::copy(distortion.begin(), distortion.end(), intrinsics.distortion.begin());
  const std::string wrong = check(intrinsics);
  fields.check(wrong.empty(), "", wrong);
}

void describe(Fields& fields, MotionFilterConfig& filter) {
  fields.field("max_speed_mps", filter.max_speed_mps,
               {.min = 0.01, .max = 50, .unit = "m/s", .help = "Faster is not believed."});
  fields.field("max_accel_mps2", filter.max_accel_mps2,
               {.min = 0.01, .max = 100, .unit = "m/s^2", .help = "What a manoeuvre is made of."});
  fields.field("max_yaw_rate_radps", filter.max_yaw_rate_radps,
               {.min = 0.01, .max = 100, .unit = "rad/s", .help = "Turning faster is not believed."});
  fields.field("max_yaw_accel_radps2", filter.max_yaw_accel_radps2,
               {.min = 0.01, .max = 1000, .unit = "rad/s^2", .help = "The same of a manoeuvre's turning."});
  fields.field("holonomic", filter.holonomic, {.help = "The robot drives sideways as well as forward."});
  fields.field(
      "manoeuvre_every_s", filter.manoeuvre_every_s,
      {.min = 0.1, .max = 1000, .unit = "s", .help = "Between changes of speed or turn, on average."});
  fields.field("observation_bias_m", filter.observation_bias_m,
               {.min = 0, .max = 1, .unit = "m", .help = "The detector's slow error per axis, one sigma."});
  fields.field("observation_bias_rad", filter.observation_bias_rad,
               {.min = 0, .max = 1, .unit = "rad", .help = "The same of yaw."});
  fields.field("bias_time_s", filter.bias_time_s,
               {.min = 0.01, .max = 1000, .unit = "s", .help = "Over which that becomes another one."});
  fields.field(
      "max_noise_scale", filter.max_noise_scale,
      {.min = 1,
       .max = 100,
       .help = "How many times what the detector claims its noise may be found to be; 1: believed."});
  fields.field("gate", filter.gate,
               {.min = 1,
                .max = 1000,
                .help = "Largest squared Mahalanobis distance of a pose that is believed; 16.3 leaves out "
                        "one of 1000."});
  fields.field("entry_bias_m", filter.entry_bias_m,
               {.min = 0,
                .max = 1,
                .unit = "m",
                .help = "A robot that is being covered is seen with an error that grows up to this."});
  fields.field("entry_s", filter.entry_s,
               {.min = 0, .max = 2, .unit = "s", .help = "Over so long before it is seen no more."});
  fields.field("calibration_observations", filter.calibration_observations,
               {.min = 1, .max = 100, .help = "Observations in agreement until there is a pose."});
  fields.field("reacquire_observations", filter.reacquire_observations,
               {.min = 2, .max = 1000, .help = "Refused ones in agreement until they are believed."});
  fields.field("max_gap_s", filter.max_gap_s,
               {.min = 0.1, .max = 1000, .unit = "s", .help = "Not observed for so long it is lost."});
  fields.field("max_sigma_m", filter.max_sigma_m,
               {.min = 0.001,
                .max = 100,
                .unit = "m",
                .help = "Lost where the position's standard deviation grows beyond."});
  fields.field("smoothing_lag_s", filter.smoothing_lag_s,
               {.min = 0,
                .max = 10,
                .unit = "s",
                .help = "How much later data a smoothed pose waits for, and how late a frame may come."});
  const std::string wrong = check(filter);
  fields.check(wrong.empty(), "", wrong);
}

void describe(Fields& fields, CalibrationSigmas& sigmas) {
  fields.about(
      "How well the camera is known: standard deviations by its calibration, each on its own. They are the "
      "same "
      "in every frame, so they stand in every published covariance and are never averaged away.");
  fields.field("focal_px", sigmas.focal_px,
               {.min = 0, .max = 1e5, .unit = "px", .help = "Of each focal length."});
  fields.field("centre_px", sigmas.centre_px,
               {.min = 0, .max = 1e5, .unit = "px", .help = "Of the optical axis' column and row."});
  std::vector<double> distortion(sigmas.distortion.begin(), sigmas.distortion.end());
  fields.field("distortion", distortion,
               {.min = 0,
                .max = 1e3,
                .max_items = 5,
                .help = "Of each coefficient, in the order of intrinsics.distortion. Those left out are 0."});
  sigmas.distortion.fill(0.0);
  std::copy(distortion.begin(), distortion.end(), sigmas.distortion.begin());
  fields.field("position_m", sigmas.position_m,
               {.min = 0, .max = 100, .unit = "m", .help = "Of the camera's place, along each axis of map."});
  fields.field("rotation_rad", sigmas.rotation_rad,
               {.min = 0, .max = 1, .unit = "rad", .help = "Of its rotation, about each axis of map."});
}

void describe(Fields& fields, WindowFilterConfig& filter) {
  fields.field("window_size", filter.window_size,
               {.min = 2, .max = 1000, .unit = "frames", .help = "Positions in the buffer."});
  fields.field(
      "alpha", filter.alpha,
      {.above = 0, .max = 100, .unit = "m", .help = "Gate: the largest distance from the prediction."});
  fields.field("calibration_threshold", filter.calibration_threshold,
               {.min = 0, .max = 1000, .unit = "frames", .help = "Detections before calibration starts."});
  fields.field("frame_loss_threshold", filter.frame_loss_threshold,
               {.min = 1,
                .max = 100000,
                .unit = "frames",
                .help = "Frames without an accepted position until calibration is cancelled."});
  const std::string wrong = check(filter);
  fields.check(wrong.empty(), "", wrong);
}

void describe(Fields& fields, TagSpec& tag) {
  fields.about("An AprilTag on the robot, lying flat. skylight tags prints them.");
  fields.field("family", tag.family,
               {.pattern = "^(36h11|25h9|16h5|Standard41h12)$",
                .pattern_words = "36h11, 25h9, 16h5 or Standard41h12",
                .help = "Family of the tag."});
  fields.field("id", tag.id, {.min = 0, .max = 2114, .required = true, .help = "Number within the family."});
  fields.field("size_m", tag.size_m,
               {.min = 0.005,
                .max = 5,
                .unit = "m",
                .help = "Outer edge of its black border (Standard41h12: of the white ring inside)."});
  fields.field("height_m", tag.height_m,
               {.min = -1, .max = 5, .unit = "m", .help = "Of the tag above the floor."});
  std::array<double, 2> position{tag.mounting.x, tag.mounting.y};
  fields.field("position_m", position,
               {.min = -5, .max = 5, .unit = "m", .help = "Its middle in base_link: forward, left."});
  fields.field("yaw_rad", tag.mounting.yaw,
               {.min = -6.3,
                .max = 6.3,
                .unit = "rad",
                .help = "Its way up from the robot's forward direction, counter-clockwise."});
  tag.mounting.x = position[0];
  tag.mounting.y = position[1];
  const std::string wrong = check(tag);
  fields.check(wrong.empty(), "", wrong);
}

void describe(Fields& fields, HomographyConfig& homography) {
  fields.about("The detector homography: the pipeline of find_object_2d, for comparison.");
  fields.field("features", homography.features,
               {.min = 10, .max = 20000, .help = "ORB features on the frame and on the picture."});
  fields.field("ratio", homography.ratio,
               {.min = 0, .max = 1, .help = "Nearest against second-nearest descriptor."});
  fields.field("ransac_px", homography.ransac_px,
               {.min = 0.01, .max = 100, .unit = "px", .help = "Reprojection threshold."});
  fields.field("min_inliers", homography.min_inliers,
               {.min = 4, .max = 1000, .help = "Least matches that agree."});
  fields.field("picture_px", homography.picture_px,
               {.min = 16, .max = 2000, .unit = "px", .help = "Longer side that the picture is brought to."});
  fields.field(
      "margin_px", homography.margin_px,
      {.min = 0, .max = 200, .unit = "px", .help = "Margin around the picture for features at its edge."});
  fields.field("match_object_to_scene", homography.match_object_to_scene,
               {.help = "false: each scene feature against the object, the package's own default."});
  fields.choice("drop", homography.drop, {{"vertical", FloorDrop::vertical}, {"ray", FloorDrop::ray}},
                {.help = "How the point is carried to the floor: straight down, or along the camera's ray."});
  std::array<double, 2> reference{homography.reference_m.x(), homography.reference_m.y()};
  fields.field(
      "reference_m", reference,
      {.min = -10,
       .max = 10,
       .unit = "m",
       .help =
           "Place on base_link that the detected point stands for; [0, 0] is base_link, else base_scan's."});
  homography.reference_m = {reference[0], reference[1]};
  fields.field("depth_noise_floor_m", homography.depth_noise_floor_m,
               {.min = 0,
                .max = 1,
                .unit = "m",
                .help = "Standard deviation of a depth z: this + depth_noise_growth (z - 0.4 m)^2."});
  fields.field("depth_noise_growth", homography.depth_noise_growth,
               {.min = 0, .max = 1, .unit = "1/m", .help = "See depth_noise_floor_m; both are a Kinect's."});
}

void describe(Fields& fields, SearchConfig& search) {
  fields.about("The search of the whole floor, spread over frames so that none is held up.");
  fields.field("tile_px", search.tile_px,
               {.min = 64, .max = 4096, .unit = "px", .help = "Side of the part looked at in one step."});
  fields.field("steps_per_frame", search.steps_per_frame,
               {.min = 1, .max = 100, .help = "Steps per frame, over all robots that are searched."});
  fields.field("first_steps_per_frame", search.first_steps_per_frame,
               {.min = 1, .max = 100, .help = "The same while no robot is tracked that this could hold up."});
}

void describe(Fields& fields, DepthConfig& depth) {
  fields.about(
      "Frames with depth: robots that are covered are told from lost ones, poses at the wrong height are "
      "refused, searches look at things of a robot's height first.");
  fields.field("use", depth.use, {.help = "false: depth is not looked at."});
  fields.field("cell_px", depth.cell_px,
               {.min = 2,
                .max = 32,
                .unit = "px",
                .help = "Side of the squares in which depth is read, four readings each."});
  fields.field("learn_frames", depth.learn_frames,
               {.min = 1,
                .max = 1000,
                .unit = "frames",
                .help = "Of the floor, until heights above it are believed."});
  fields.field("follow_frames", depth.follow_frames,
               {.min = 1,
                .max = 100000,
                .unit = "frames",
                .help = "Over which the correction of the sensor follows; at least learn_frames."});
  fields.field(
      "follow_interval", depth.follow_interval,
      {.min = 1, .max = 1000, .unit = "frames", .help = "Between looks at the floor once it is learnt."});
  fields.field("tolerance_m", depth.tolerance_m,
               {.min = 0.001,
                .max = 1,
                .unit = "m",
                .help = "By which a surface may be off its height, whatever the noise."});
  fields.field(
      "sigmas", depth.sigmas,
      {.min = 1, .max = 10, .help = "By how many standard deviations of the depth, where those are more."});
  fields.field("covered_share", depth.covered_share,
               {.min = 0.05,
                .max = 1,
                .help = "Of a robot's surface behind higher things, from which it is covered."});
  fields.field("correct_homography", depth.correct_homography,
               {.help = "The detector homography reads the corrected depth; false: the sensor's own."});
  const std::string wrong = check(depth);
  fields.check(wrong.empty(), "", wrong);
}

void describe(Fields& fields, CameraWatchConfig& watch) {
  fields.field("interval_s", watch.interval_s, {.min = 0, .max = 60, .unit = "s", .help = "Between looks."});
  fields.field("learn_s", watch.learn_s,
               {.min = 0, .max = 60, .unit = "s", .help = "Over which features of the floor have to stay."});
  fields.field(
      "settle_s", watch.settle_s,
      {.min = 0, .max = 60, .unit = "s", .help = "So long looks must agree until they are believed."});
  fields.field("features", watch.features,
               {.min = 9, .max = 1024, .help = "At most, spread over the picture."});
  fields.field("least_shift_px", watch.least_shift_px,
               {.min = 0.1, .max = 1000, .unit = "px", .help = "Moved by less is not told."});
  fields.field("least_match", watch.least_match,
               {.min = 0.3, .max = 1, .help = "Correlation at which a feature is seen again."});
  fields.field(
      "least_share", watch.least_share,
      {.min = 0.1, .max = 1, .help = "Of the features that have to agree, else the camera is blind."});
}

}  // namespace skylight
