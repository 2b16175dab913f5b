// A JSON text (comments allowed) as a tree in which every value knows the line it came from.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace skylight::settings {

inline constexpr std::size_t kMaxBytes = 16u << 20;   ///< of a text
inline constexpr std::size_t kMaxValues = 1'000'000;  ///< values in one text
inline constexpr int kMaxDepth = 64;                  ///< objects and lists inside each other

/// What is wrong with a text, a file or a value in it. what() is one line:
/// `room.json:12: robots[0].speed: 7 is out of range, allowed 0 to 0.26 m/s`.
class Error : public std::runtime_error {
 public:
  Error(std::string file, int line, std::string key_path, std::string message);

  std::string file;      ///< name of the text, or what set the value (`--set`, an environment variable)
  int line;              ///< from 1; 0 where there is none
  std::string key_path;  ///< `robots[0].speed`; empty for the text as a whole
  std::string message;
};

/// One value. Objects keep the order of the text; keys[i] names children[i].
struct Node {
  enum class Kind : std::uint8_t { scalar, array, object };
  using Scalar = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string>;

  Kind kind = Kind::scalar;
  std::uint16_t source = 0;  ///< index into Document::sources
  int line = 0;              ///< from 1; 0 for values that were set (source > 0)
  Scalar scalar;             ///< monostate is null; a whole number is int64_t unless it only fits uint64_t
  std::vector<Node> children;
  std::vector<std::string> keys;

  /// The member of that name; null where there is none.
  const Node* find(std::string_view key) const;
};

/// Where values come from.
struct Source {
  std::string name;  ///< of the text, or what set the value
  std::string text;  ///< of a single value that was set, as given: where a string is wanted, `7` is one
};

struct Document {
  Node root;
  std::vector<Source> sources;  ///< [0] the text; then one per value that was set
};

/// Reads a JSON text; `name` is how errors call it. Refused with line and key path: what is no JSON (but //
/// and /* */ comments), invalid UTF-8, a key twice in one object, numbers too big for a double, and texts
/// beyond the limits above.
Document parse(std::string_view text, std::string name);

/// parse() of a file; errors name it as given.
Document load(const std::filesystem::path& file);

/// Sets the value at `path` (`tracker.filter.alpha`, `robots[0].id`; the index after the last appends),
/// making the objects on the way. `value` is JSON, or else taken as a string. Errors found later in it are
/// told as coming from `origin` (`--set`, `SKYLIGHT_SERVER__PORT`).
void set(Document& document, std::string_view path, std::string_view value, const std::string& origin);

/// The node at `path` below `node`, or the last one on the way to it that exists.
const Node& nearest_node(const Node& node, std::string_view path);

/// set() from one `key.path=value` text.
void set(Document& document, std::string_view assignment, const std::string& origin);

}  // namespace skylight::settings
