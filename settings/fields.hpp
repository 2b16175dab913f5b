// One description of a configuration struct serves reading, the JSON Schema and printing.
//
//   struct Gate { double alpha_m = 0.3; int window = 12; };
//   void describe(Fields& fields, Gate& gate) {
//     fields.field("alpha", gate.alpha_m, {.min = 0.001, .max = 100, .unit = "m", .help = "Gate ..."});
//     fields.field("window", gate.window, {.min = 2, .max = 1000, .help = "..."});
//   }
//   Gate gate = settings::read<Gate>(settings::parse(text, "room.json"));
//
// A struct starts with its defaults; a key that is absent leaves them. Unknown keys, wrong types, ranges
// and NaN are refused with file, line, key path, value and bound; nothing is repaired silently.
#pragma once
