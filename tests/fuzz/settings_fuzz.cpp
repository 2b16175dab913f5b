// Any bytes are a document, or one clear line that says why not; what is accepted can be written and read
// again. A first line that starts with '=' is a key.path=value text to set on the rest.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "settings/fields.hpp"
#include "settings/text.hpp"
#include "tests/settings/room.hpp"

// NOLINTNEXTLINE(readability-identifier-naming): the name that libFuzzer calls
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using skylight::test::Room;
  namespace settings = skylight::settings;
  std::string_view text(reinterpret_cast<const char*>(data), size);
  std::string_view assignment;
  if (text.starts_with('=')) {
    assignment = text.substr(1, text.find('\n') - 1);
    text.remove_prefix(std::min(text.size(), assignment.size() + 2));
  }
  std::string written;
  try {
    settings::Document document = settings::parse(text, "fuzz");
    if (!assignment.empty()) settings::set(document, assignment, "--set");
    written = settings::write(settings::read<Room>(document));
  } catch (const settings::Error& error) {
    const std::string_view what = error.what();
    const bool one_clear_line = !what.empty() && what.size() < 10000 && settings::is_utf8(what) &&
                                what.find('\n') == std::string_view::npos;
    if (!one_clear_line) std::abort();
    return 0;
  }
  if (settings::write(settings::read<Room>(settings::parse(written, "written"))) != written) std::abort();
  return 0;
}
