// Prints a schema, and samples with our reader's verdict, for check_schema.py.
#include "tests/settings/samples.hpp"

#include <cstdio>

#include "tests/settings/room.hpp"

int main() {
  using skylight::test::Look;
  using skylight::test::Room;
  using skylight::test::samples;
  const nlohmann::json all = {
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
