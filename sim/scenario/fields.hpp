// How each part of a scenario is read and described: one describe() per struct, in the file named after it.
#pragma once

#include <string_view>

#include "settings/rules.hpp"
#include "sim/scenario/scenario.hpp"

namespace skylight::settings {
class Fields;
}

namespace skylight::sim {

/// Rules of a key that names something.
settings::Rules id_rules(std::string_view help, bool required = true);

// room_fields.cpp
void describe(settings::Fields& fields, RoomSpec& room);
void describe(settings::Fields& fields, LightSpec& light);
void describe(settings::Fields& fields, ObjectSpec& object);
void describe(settings::Fields& fields, PersonSpec& person);
// camera_fields.cpp
void describe(settings::Fields& fields, CameraSpec& camera);
// robot_fields.cpp
void describe(settings::Fields& fields, StartSpec& start);
void describe(settings::Fields& fields, ProgramStep& step);
void describe(settings::Fields& fields, RobotSpec& robot);
// event_fields.cpp
void describe(settings::Fields& fields, EventSpec& event);
void describe(settings::Fields& fields, ActionSpec& action);

}  // namespace skylight::sim
