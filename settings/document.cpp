#include "settings/document.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <unordered_map>

#include <nlohmann/json.hpp>

#include "settings/text.hpp"

namespace skylight::settings {
namespace {

constexpr std::string_view kSetOrigin = "--set";

std::string describe_error(const std::string& file, int line, const std::string& path,
                           const std::string& message) {
  std::string text = printable(file);
  if (line > 0) text += ":" + std::to_string(line);
  if (!path.empty()) text += (file == kSetOrigin ? " " : ": ") + path;
  return text + ": " + message;
}

/// The parser tells no positions, so it reads through an iterator that counts. It looks at most one character
/// beyond a token, and tokens hold no line breaks: a token ends on the line of the last character read that
/// is no white space.
struct Lines {
  int current = 1;
  int token = 1;
};

class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, Lines* lines) : at_(at), lines_(lines) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    if (*at_ == '\n') {
      ++lines_->current;
    } else if (*at_ != ' ' && *at_ != '\t' && *at_ != '\r') {
      lines_->token = lines_->current;
    }
    ++at_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  Lines* lines_;
};

/// "[json.exception.parse_error.101] parse error at line 3, column 5: syntax error ...; last read: '...'"
/// without what we say ourselves, and with a bound on what it quotes.
std::string syntax_message(std::string text) {
  if (const auto column = text.find(", column "); column != std::string::npos) {
    if (const auto colon = text.find(": ", column); colon != std::string::npos) text.erase(0, colon + 2);
  }
  std::string quoted;
  constexpr std::string_view kLastRead = "; last read: ";
  if (const auto last_read = text.find(kLastRead); last_read != std::string::npos) {
    quoted = text.substr(last_read + kLastRead.size());
    text.resize(last_read);
  }
  std::string message = printable(text, 200);
  if (!quoted.empty()) message += ", at " + printable(quoted, 40);
  return message;
}

/// Takes the parser's events and builds the tree.
class Builder {
 public:
  Builder(Document& document, const Lines& lines) : document_(document), lines_(lines) {}

  bool null() { return scalar(std::monostate{}); }
  bool boolean(bool value) { return scalar(value); }
  bool number_integer(std::int64_t value) { return scalar(value); }
  bool number_unsigned(std::uint64_t value) {
    if (value <= static_cast<std::uint64_t>(INT64_MAX)) return scalar(static_cast<std::int64_t>(value));
    return scalar(value);
  }
  bool number_float(double value, const std::string& /*text*/) { return scalar(value); }
  bool string(std::string& value) { return scalar(std::move(value)); }
  bool binary(std::vector<std::uint8_t>& /*value*/) { return false; }  // not in JSON texts
  bool start_object(std::size_t /*unknown*/) { return open(Node::Kind::object); }
  bool start_array(std::size_t /*unknown*/) { return open(Node::Kind::array); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }

  bool key(std::string& name) {
    Open& object = open_.back();
    object.node->keys.push_back(name);
    const auto [first, is_new] = object.key_lines.try_emplace(std::move(name), lines_.token);
    if (!is_new) fail("is given twice, first on line " + std::to_string(first->second));
    return true;
  }

  bool parse_error(std::size_t /*position*/, const std::string& token,
                   const nlohmann::json::exception& error) {
    constexpr int kNumberOverflow = 406;
    if (error.id == kNumberOverflow) fail("the number " + printable(token, 40) + " is too big");
    fail(syntax_message(error.what()));
  }

 private:
  struct Open {
    Node* node;
    std::unordered_map<std::string, int> key_lines;
  };

  bool scalar(Node::Scalar value) {
    add(Node::Kind::scalar).scalar = std::move(value);
    return true;
  }

  bool open(Node::Kind kind) {
    if (open_.size() >= kMaxDepth) {
      fail("more than " + std::to_string(kMaxDepth) + " objects and lists inside each other");
    }
    open_.push_back({&add(kind), {}});
    return true;
  }

  bool close() {
    open_.pop_back();
    return true;
  }

  Node& add(Node::Kind kind) {
    if (++values_ > kMaxValues) fail("more than " + std::to_string(kMaxValues) + " values");
    // A parent gets no further child while one of its children is open: the pointers in open_ stay good.
    Node& node = open_.empty() ? document_.root : open_.back().node->children.emplace_back();
    node.kind = kind;
    node.line = lines_.token;
    return node;
  }

  [[noreturn]] void fail(const std::string& message) const {
    std::string path;
    for (std::size_t i = 0; i < open_.size(); ++i) {
      const Node& node = *open_[i].node;
      // The child that is open in it: the last; in the innermost, the one to come.
      const bool innermost = i + 1 == open_.size();
      if (node.kind == Node::Kind::object) {
        const bool has_key = !node.keys.empty() && (!innermost || node.keys.size() > node.children.size());
        if (has_key) path += path_step(node.keys.back(), path.empty());
      } else {
        path += "[" + std::to_string(node.children.size() - (innermost ? 0 : 1)) + "]";
      }
    }
    throw Error(document_.sources.front().name, lines_.token, path, message);
  }

  Document& document_;
  const Lines& lines_;
  std::vector<Open> open_;
  std::size_t values_ = 0;
};

}  // namespace

Error::Error(std::string file_name, int line_number, std::string path, std::string what_is_wrong)
    : std::runtime_error(describe_error(file_name, line_number, path, what_is_wrong)),
      file(std::move(file_name)),
      line(line_number),
      key_path(std::move(path)),
      message(std::move(what_is_wrong)) {}

const Node* Node::find(std::string_view key) const {
  const auto found = std::find(keys.begin(), keys.end(), key);
  return found == keys.end() ? nullptr : &children[static_cast<std::size_t>(found - keys.begin())];
}

Document parse(std::string_view text, std::string name) {
  if (text.size() > kMaxBytes) {
    throw Error(name, 0, "", "is longer than " + std::to_string(kMaxBytes >> 20) + " MiB");
  }
  if (const auto nul = text.find('\0'); nul != std::string_view::npos) {  // would end the text for the parser
    const auto breaks = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(nul), '\n');
    throw Error(name, static_cast<int>(breaks) + 1, "", "holds a NUL byte: this is no text");
  }
  Document document;
  document.sources.push_back({std::move(name), {}});
  Lines lines;
  Builder builder(document, lines);
  nlohmann::json::sax_parse(CountingIterator(text.data(), &lines),
                            CountingIterator(text.data() + text.size(), &lines), &builder,
                            nlohmann::json::input_format_t::json, /*strict=*/true, /*ignore_comments=*/true);
  return document;
}

Document load(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& why) {
    throw Error(file.string(), 0, "", "cannot be read: " + why);
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) refuse("it is a folder");
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) refuse(std::strerror(errno));
  std::string text(kMaxBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) refuse("reading failed");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return parse(text, file.string());
}

}  // namespace skylight::settings
