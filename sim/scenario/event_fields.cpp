// The keys of events: when, and what.
#include "settings/fields.hpp"
#include "sim/scenario/fields.hpp"

namespace skylight::sim {

using settings::Fields;
using settings::Rules;

namespace {

Rules name_rules(std::string_view help) {
  return {.min_length = 1, .max_length = 64, .required = true, .help = help};
}
Rules seconds(std::string_view help) {
  return {.min = 0, .max = 604800, .unit = "s", .help = help};
}
Rules metres(double least, double most, std::string_view help) {
  return {.min = least, .max = most, .unit = "m", .help = help};
}

}  // namespace

void describe(Fields&, SignalAction&) {}

void describe(Fields& fields, LightAction& action) {
  fields.field("level", action.level,
               {.min = 0, .max = 4, .required = true, .help = "Factor on every colour from then on."});
  fields.field("over_s", action.over_s, seconds("Gets there evenly in so long."));
}

void describe(Fields& fields, ShadowAction& action) {
  fields.field("darkness", action.darkness,
               {.min = 0, .max = 1, .help = "Share of the light missing in its middle."});
  fields.field("width_m", action.width_m, metres(0.05, 100, "From where it begins to where it ends."));
  fields.field("direction_deg", action.direction_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "Towards which it moves, in map."});
  fields.field("speed_mps", action.speed_mps, {.above = 0, .max = 100, .unit = "m/s"});
}

void describe(Fields& fields, BumpAction& action) {
  fields.field("camera", action.camera, name_rules("Which camera."));
  fields.field("by_mm", action.by_mm,
               {.min = -10000, .max = 10000, .unit = "mm", .help = "Along map x, y, z."});
  fields.field("by_deg", action.by_deg,
               {.min = -180,
                .max = 180,
                .unit = "deg",
                .help = "About map x, y, z, in this order, through its optical centre."});
}

void describe(Fields& fields, KidnapAction& action) {
  fields.field("robot", action.robot, name_rules("Which robot."));
  fields.field("to", action.to, {.required = true, .help = "Where it is put down."});
  fields.field("away_s", action.away_s, seconds("Seen nowhere for so long."));
}

void describe(Fields& fields, PowerAction& action) {
  fields.field("robot", action.robot, name_rules("Which robot."));
  fields.field("on", action.on,
               {.required = true, .help = "Off: its wheels stand still and it reports no odometry."});
}

void describe(Fields& fields, CoverAction& action) {
  fields.field("robot", action.robot, name_rules("Which robot."));
  fields.field("tag_only", action.tag_only, {.help = "Its tag alone, else its whole top."});
  fields.field("for_s", action.for_s, seconds("0: for good."));
}

void describe(Fields& fields, FreezeAction& action) {
  fields.field("camera", action.camera, name_rules("Which camera."));
  fields.field("for_s", action.for_s, seconds("Repeats its last picture for so long."));
}

void describe(Fields& fields, BlackoutAction& action) {
  fields.field("camera", action.camera, name_rules("Which camera."));
  fields.field("for_s", action.for_s, seconds("Sends nothing for so long."));
}

void describe(Fields& fields, SlipAction& action) {
  fields.field("robot", action.robot, name_rules("Which robot."));
  fields.field("grip", action.grip, {.min = 0, .max = 2, .help = "Factor on its tyres' friction."});
  fields.field("for_s", action.for_s, seconds("For so long."));
}

void describe(Fields& fields, DriveAction& action) {
  fields.field("robot", action.robot, name_rules("Which robot."));
  fields.field("v_mps", action.v_mps, {.min = -10, .max = 10, .unit = "m/s", .help = "Forward speed."});
  fields.field("side_mps", action.side_mps,
               {.min = -10, .max = 10, .unit = "m/s", .help = "To the left; holonomic robots only."});
  fields.field("w_degps", action.w_degps,
               {.min = -720, .max = 720, .unit = "deg/s", .help = "Yaw rate, positive to the left."});
  fields.field("for_s", action.for_s, seconds("Then its program goes on."));
}

void describe(Fields& fields, PushAction& action) {
  fields.field("robot", action.robot, name_rules("Which robot."));
  fields.field("impulse_ns", action.impulse_ns, {.min = -100, .max = 100, .unit = "N s", .help = "In map."});
}

void describe(Fields& fields, PutAction& action) {
  fields.field("object", action.object, {.required = true, .help = "What is put into the room."});
}

void describe(Fields& fields, RemoveAction& action) {
  fields.field("object", action.object, name_rules("Which thing is taken away."));
}

void describe(Fields& fields, AfterEvent& condition) {
  fields.field("event", condition.event, name_rules("Name of another event."));
  fields.field("delay_s", condition.delay_s, seconds("So long after it."));
}

void describe(Fields& fields, RobotAt& condition) {
  fields.field("robot", condition.robot, name_rules("Which robot."));
  fields.field("place_m", condition.place_m,
               {.min = -200, .max = 200, .unit = "m", .required = true, .help = "Place in map, [x, y]."});
  fields.field("within_m", condition.within_m, metres(0.001, 100, "How near."));
}

void describe(Fields& fields, RobotsNear& condition) {
  fields.field("robot", condition.robot, name_rules("One robot."));
  fields.field("other", condition.other, name_rules("The other."));
  fields.field("within_m", condition.within_m, metres(0.001, 100, "How near, base_link to base_link."));
}

void describe(Fields& fields, RobotTouches& condition) {
  fields.field("robot", condition.robot, name_rules("Which robot touches anything."));
}

void describe(Fields& fields, ProgramDone& condition) {
  fields.field("robot", condition.robot, name_rules("Which robot has done the last step of its program."));
}

void describe(Fields& fields, Condition& condition) {
  fields.about("What must hold for an event to happen.");
  fields.variant("is", condition.is,
                 {{"after", "Another event has happened."},
                  {"robot_at", "A robot is near a place."},
                  {"robots_near", "Two robots are near each other."},
                  {"robot_touches", "A robot touches something."},
                  {"program_done", "A robot's program is over."}},
                 {.required = true, .help = "Kind of condition."});
}

namespace {

void describe_action(Fields& fields, Action& action) {
  fields.variant("do", action,
                 {{"signal", "Nothing: for programs that wait and events that follow."},
                  {"light", "The light goes to another level."},
                  {"shadow", "A soft-edged band of shadow crosses the room."},
                  {"bump", "Somebody knocks against a camera: it hangs otherwise from then on."},
                  {"kidnap", "A robot is taken up and put down elsewhere."},
                  {"power", "A robot is switched off or on."},
                  {"cover", "Something lies on a robot's top."},
                  {"freeze", "A camera repeats its last picture."},
                  {"blackout", "A camera sends nothing."},
                  {"slip", "A robot's tyres lose their grip."},
                  {"drive", "Somebody drives a robot; its program waits."},
                  {"push", "A robot gets a knock."},
                  {"put", "A thing is put into the room."},
                  {"remove", "A thing is taken out of the room."}},
                 {.required = true, .help = "What happens."});
}

}  // namespace

void describe(Fields& fields, ActionSpec& spec) {
  fields.about("Something that is done to the room, a robot or a camera.");
  describe_action(fields, spec.action);
}

void describe(Fields& fields, EventSpec& event) {
  fields.about("Something that happens at a time, or the first time that a condition holds.");
  fields.field("name", event.name,
               {.max_length = 64, .help = "For programs that wait for it and events that follow it."});
  fields.field("at_s", event.at_s, seconds("Time of the scenario."));
  fields.field("when", event.when, {.help = "A condition, where it is not a time."});
  fields.exactly_one_of({"at_s", "when"});
  fields.field(
      "every_s", event.every_s,
      {.min = 0, .max = 604800, .unit = "s", .help = "Happens again and again, so long apart; 0: once."});
  describe_action(fields, event.action);
}

}  // namespace skylight::sim
