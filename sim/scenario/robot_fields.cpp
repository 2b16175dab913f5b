// The keys of a robot and of its motion program.
#include "settings/fields.hpp"
#include "sim/scenario/fields.hpp"

namespace skylight::sim {

using settings::Fields;

void describe(Fields& fields, PictureSpec& picture) {
  fields.about("The picture on a robot's top plate: drawn from a seed, or an image file.");
  fields.field("enabled", picture.enabled, {.help = "Off: the bare plate."});
  fields.field(
      "file", picture.file,
      {.help = "Image file, relative to the scenario file; its up is the robot's front. Absent: drawn."});
  fields.field(
      "seed", picture.seed,
      {.help =
           "Of the drawn picture; 0: by the robot's place in the list. Equal seeds make identical robots."});
  fields.field("width_m", picture.width_m,
               {.min = 0.01,
                .max = 10,
                .unit = "m",
                .help = "Width on the plate, at most the plate's; absent: the plate's."});
}

void describe(Fields& fields, StartSpec& start) {
  fields.about("Where base_link stands at the start, in map.");
  fields.field("x_m", start.x_m, {.min = -200, .max = 200, .unit = "m"});
  fields.field("y_m", start.y_m, {.min = -200, .max = 200, .unit = "m"});
  fields.field("yaw_deg", start.yaw_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "Counter-clockwise from map x."});
}

void describe(Fields& fields, TagSpec& tag) {
  fields.about("An AprilTag on the robot's top, over its picture if it has one.");
  fields.field("family", tag.family,
               {.pattern = "^(36h11|25h9|16h5|Standard41h12)$",
                .pattern_words = "36h11, 25h9, 16h5 or Standard41h12",
                .help = "Family of the tag."});
  fields.field("id", tag.id, {.min = 0, .max = 2114, .help = "Number within the family."});
  fields.field("size_m", tag.size_m,
               {.min = 0.01, .max = 10, .unit = "m", .help = "Outer edge of its border."});
  fields.field("x_m", tag.x_m,
               {.min = -10,
                .max = 10,
                .unit = "m",
                .help = "Its middle, forward of the plate's; with y_m absent: where there is room."});
  fields.field("y_m", tag.y_m,
               {.min = -10,
                .max = 10,
                .unit = "m",
                .help = "Its middle, left of the plate's; with x_m absent: where there is room."});
  fields.field("yaw_deg", tag.yaw_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "0: its up is the robot's front."});
}

void describe(Fields& fields, OdometrySpec& odometry) {
  fields.about("Wheel encoders, and how wrong the robot's idea of its wheels is. Slip comes from the floor.");
  fields.field("rate_hz", odometry.rate_hz,
               {.min = 1, .max = 500, .unit = "Hz", .help = "Reports a second."});
  fields.field("ticks_per_turn", odometry.ticks_per_turn,
               {.min = 4, .max = 1e7, .help = "Of the encoder, per turn of a wheel."});
  fields.field("wheel_radius_error", odometry.wheel_radius_error,
               {.min = 0, .max = 0.2, .help = "Standard deviation, as a share, drawn for each wheel."});
  fields.field(
      "separation_error", odometry.separation_error,
      {.min = 0, .max = 0.2, .help = "Standard deviation, as a share, of the distance between the wheels."});
  fields.field("clock_offset_s", odometry.clock_offset_s,
               {.min = -3600, .max = 3600, .unit = "s", .help = "Time stamp less true time."});
}

namespace {

const settings::Rules kSpeed{.above = 0, .max = 10, .unit = "m/s", .help = "Speed on the way."};

}  // namespace

void describe(Fields& fields, LineStep& step) {
  fields.field("distance_m", step.distance_m,
               {.above = 0, .max = 1000, .unit = "m", .help = "Straight ahead so far."});
  fields.field(
      "to_m", step.to_m,
      {.min = -200, .max = 200, .unit = "m", .help = "Turns towards this place in map, then goes there."});
  fields.exactly_one_of({"distance_m", "to_m"});
  fields.field("speed_mps", step.speed_mps, kSpeed);
}

void describe(Fields& fields, ArcStep& step) {
  fields.field("radius_m", step.radius_m,
               {.above = 0, .max = 1000, .unit = "m", .help = "Of the circle that base_link drives."});
  fields.field(
      "angle_deg", step.angle_deg,
      {.min = -36000, .max = 36000, .unit = "deg", .help = "Positive to the left, negative to the right."});
  fields.field("speed_mps", step.speed_mps, kSpeed);
  fields.check(step.angle_deg != 0.0, "angle_deg", "must not be 0");
}

void describe(Fields& fields, CircleStep& step) {
  fields.field("radius_m", step.radius_m,
               {.above = 0,
                .max = 1000,
                .unit = "m",
                .help = "Of the circle that base_link drives; its middle lies to the side."});
  fields.field("rounds", step.rounds, {.above = 0, .max = 1e6, .help = "How often round."});
  fields.field("speed_mps", step.speed_mps, kSpeed);
  fields.field("right", step.right, {.help = "Clockwise."});
}

void describe(Fields& fields, FigureEightStep& step) {
  fields.field(
      "radius_m", step.radius_m,
      {.above = 0, .max = 1000, .unit = "m", .help = "Of each of its two circles, the left one first."});
  fields.field("rounds", step.rounds, {.min = 0, .max = 1e6, .help = "0: for ever."});
  fields.field("speed_mps", step.speed_mps, kSpeed);
}

void describe(Fields& fields, TurnStep& step) {
  fields.field(
      "angle_deg", step.angle_deg,
      {.min = -36000, .max = 36000, .unit = "deg", .help = "Positive to the left, negative to the right."});
  fields.field("rate_degps", step.rate_degps, {.above = 0, .max = 720, .unit = "deg/s"});
  fields.check(step.angle_deg != 0.0, "angle_deg", "must not be 0");
}

void describe(Fields& fields, WaypointsStep& step) {
  fields.field("points_m", step.points_m,
               {.min = -200,
                .max = 200,
                .unit = "m",
                .min_items = 1,
                .max_items = 10000,
                .required = true,
                .help = "Places in map, [x, y] each."});
  fields.field("speed_mps", step.speed_mps, kSpeed);
  fields.field("loop", step.loop, {.help = "From the last point on to the first, for ever."});
}

void describe(Fields& fields, WanderStep& step) {
  fields.field("for_s", step.for_s, {.min = 0, .max = 604800, .unit = "s", .help = "0: for ever."});
  fields.field("speed_mps", step.speed_mps, {.above = 0, .max = 10, .unit = "m/s", .help = "Fastest."});
  fields.field("rate_degps", step.rate_degps,
               {.min = 0, .max = 720, .unit = "deg/s", .help = "Fastest turn."});
  fields.field("changes_per_min", step.changes_per_min,
               {.above = 0, .max = 600, .help = "Of speed and turn rate, on average."});
  fields.field("stops", step.stops, {.min = 0, .max = 1, .help = "Share of the changes that are stops."});
  fields.field("avoid_m", step.avoid_m,
               {.min = 0,
                .max = 10,
                .unit = "m",
                .help = "Distance that it keeps from everything if it can; 0: it looks for nothing."});
  fields.field("seed", step.seed, {.help = "0: from the scenario's seed and the robot's place in the list."});
}

void describe(Fields& fields, DriveStep& step) {
  fields.field("v_mps", step.v_mps, {.min = -10, .max = 10, .unit = "m/s", .help = "Forward speed."});
  fields.field("side_mps", step.side_mps,
               {.min = -10, .max = 10, .unit = "m/s", .help = "To the left; holonomic robots only."});
  fields.field("w_degps", step.w_degps,
               {.min = -720, .max = 720, .unit = "deg/s", .help = "Yaw rate, positive to the left."});
  fields.field("for_s", step.for_s, {.above = 0, .max = 604800, .unit = "s", .help = "How long."});
}

void describe(Fields& fields, StopStep& step) {
  fields.field("for_s", step.for_s, {.above = 0, .max = 604800, .unit = "s", .help = "How long."});
}

void describe(Fields& fields, WaitStep& step) {
  fields.field("event", step.event,
               {.min_length = 1,
                .max_length = 64,
                .required = true,
                .help = "Name of an event: goes on once it has happened."});
  fields.field(
      "at_most_s", step.at_most_s,
      {.min = 0, .max = 604800, .unit = "s", .help = "Then goes on all the same; 0: waits for ever."});
}

void describe(Fields& fields, RepeatStep& step) {
  fields.field("times", step.times, {.min = 0, .max = 1e6, .help = "0: for ever."});
  fields.field("steps", step.steps,
               {.min_items = 1, .max_items = 1000, .required = true, .help = "What is repeated."});
}

void describe(Fields& fields, ParallelStep& step) {
  fields.field("steps", step.steps,
               {.min_items = 2,
                .max_items = 10,
                .required = true,
                .help = "Done at the same time, their speeds added; over when all are."});
}

void describe(Fields& fields, RunStep& step) {
  fields.field("program", step.program,
               {.min_length = 1,
                .max_length = 64,
                .required = true,
                .help = "Name of one of the scenario's programs."});
}

void describe(Fields& fields, ProgramStep& step) {
  fields.about("One step of a motion program.");
  fields.variant("do", step.action,
                 {{"line", "Straight, for a distance or to a place."},
                  {"arc", "Along a part of a circle."},
                  {"circle", "Round and round."},
                  {"figure_eight", "A circle to the left and one to the right."},
                  {"turn", "On the spot."},
                  {"waypoints", "From place to place by pure pursuit."},
                  {"wander", "About at random, avoiding what stands in the way."},
                  {"drive", "Constant speed and yaw rate for a time, not steered by where the robot is."},
                  {"stop", "Stand still."},
                  {"wait", "Stand still until an event has happened."},
                  {"repeat", "Other steps, again and again."},
                  {"parallel", "Other steps, at the same time."},
                  {"run", "One of the scenario's programs."}},
                 {.required = true, .help = "What the robot does."});
}

void describe(Fields& fields, CopiesSpec& copies) {
  fields.about(
      "Further robots like this one, in rows beside it: <id>-2 and so on. With a picture seed of 0 each has "
      "its own picture, else they look the same.");
  fields.field("count", copies.count, {.min = 1, .max = 500, .help = "In all, the first included."});
  fields.field("per_row", copies.per_row, {.min = 1, .max = 500, .help = "Then the next row begins."});
  fields.field(
      "spacing_m", copies.spacing_m,
      {.min = -10, .max = 10, .unit = "m", .help = "Along map x within a row, along map y from row to row."});
}

void describe(Fields& fields, RobotSpec& robot) {
  fields.about("A robot. After the last step of its program it stands still.");
  fields.field("id", robot.id, id_rules("Name, unlike any other robot's."));
  fields.choice("model", robot.model,
                {{"waffle_pi", RobotModelName::waffle_pi},
                 {"burger", RobotModelName::burger},
                 {"differential", RobotModelName::differential},
                 {"holonomic", RobotModelName::holonomic}},
                {.help = "waffle_pi, burger: TurtleBot3; differential: a round one with two wheels; "
                         "holonomic: one with omni-wheels."});
  fields.field("picture", robot.picture);
  fields.field("tag", robot.tag, {.help = "Absent: none."});
  fields.field("start", robot.start);
  fields.field("odometry", robot.odometry);
  fields.field("program", robot.program, {.max_items = 1000, .help = "What it does, step by step."});
  fields.field("copies", robot.copies);
}

}  // namespace skylight::sim
