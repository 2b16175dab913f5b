// Prints a schema, and samples with our reader's verdict, for check_schema.py.
#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include "settings/fields.hpp"
#include "tests/settings/room.hpp"

namespace {

using nlohmann::json;
using skylight::test::Look;
using skylight::test::Room;

template <class T>
json samples(const char* title, std::initializer_list<const char*> texts) {
  json cases = json::array();
  for (const char* text : texts) {
    std::string refusal;
    try {
      skylight::settings::read<T>(skylight::settings::parse(text, "sample"));
    } catch (const skylight::settings::Error& error) {
      refusal = error.what();
    }
    cases.push_back({{"text", text}, {"refusal", refusal}});
  }
  return {{"schema", json::parse(skylight::settings::schema<T>(title))},
          {"defaults", json::parse(skylight::settings::write(T{}))},
          {"cases", cases}};
}

}  // namespace

int main() {
  const json all = {
      samples<Room>("Room",
                    {"{}",
                     "[]",
                     "3",
                     R"({"width": 0})",
                     R"({"width": 1e300})",
                     R"({"width": "x"})",
                     R"({"widht": 1})",
                     R"({"lit": 0})",
                     R"({"lit": false})",
                     R"({"lamps": 3.0})",
                     R"({"lamps": 3.5})",
                     R"({"lamps": 2147483647})",
                     R"({"lamps": 2147483648})",
                     R"({"seed": -1})",
                     R"({"seed": 18446744073709551615})",
                     R"({"walls": 3})",
                     R"({"walls": 13})",
                     R"({"floor": "tiles"})",
                     R"({"floor": "wood"})",
                     R"({"floor": null})",
                     R"({"name": "größe"})",
                     R"({"name": "größer"})",
                     R"({"name": ""})",
                     R"({"first": {"length": 100}})",
                     R"({"first": {"length": 101}})",
                     R"({"first": []})",
                     R"({"marks": {"a": 10}})",
                     R"({"marks": {"a": 11}})",
                     R"({"marks": {"A": 1}})",
                     R"({"robots": [{}]})",
                     R"({"robots": [{"id": "a"}]})",
                     R"({"robots": [{"id": "A"}]})",
                     R"({"robots": [{"id": "a"}, {"id": "b"}, {"id": "c"}, {"id": "d"}]})",
                     R"({"robots": [{"id": "a", "start": [3, -3]}]})",
                     R"({"robots": [{"id": "a", "start": [3]}]})",
                     R"({"robots": [{"id": "a", "start": [3, 4]}]})",
                     R"({"robots": [{"id": "a", "start": null}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "drive", "pause": 1}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "turn", "length": 1, "angle": 1}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "turn", "angle": 7}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "turn"}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"length": 1}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "repeat", "program": []}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "repeat", "program":
                        [{"type": "repeat", "times": 3, "program": [{"type": "turn", "angle": 1}]}]}]}]})",
                     R"({"robots": [{"id": "a", "program": [{"type": "repeat", "program":
                        [{"type": "repeat", "times": 0, "program": [{"type": "turn", "angle": 1}]}]}]}]})"}),
      samples<Look>("Look", {"{}", R"({"box": 1})", R"({"picture": "a"})", R"({"box": 1, "picture": "a"})"})};
  std::puts(all.dump().c_str());
}
