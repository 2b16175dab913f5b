// The untemplated half of fields.hpp: reading, describing and writing single values. Include fields.hpp
// instead.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <typeindex>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "settings/document.hpp"
#include "settings/rules.hpp"

namespace skylight::settings::detail {

using Json = nlohmann::ordered_json;

/// Where reading stands: the document, and the key path down to the value.
struct Reading {
  const Document* document;
  std::string path;

  [[noreturn]] void fail(const Node& node, const std::string& message) const;
};

/// Lengthens the path while it lives.
class PathStep {
 public:
  PathStep(Reading& reading, std::string_view key);
  PathStep(Reading& reading, std::size_t index);
  ~PathStep() { reading_.path.resize(length_); }
  PathStep(const PathStep&) = delete;
  PathStep& operator=(const PathStep&) = delete;

 private:
  Reading& reading_;
  std::size_t length_;
};

/// A value that JSON types cannot be named with in a header that only knows them by declaration.
class JsonBox {
 public:
  JsonBox();
  JsonBox(JsonBox&&) noexcept;
  ~JsonBox();
  Json& get() { return *json_; }

 private:
  std::unique_ptr<Json> json_;
};

/// Definitions of the schema so far, by type.
struct Schema {
  JsonBox definitions;
  std::map<std::type_index, std::string> names;

  /// The name for a type, and whether it is new (its definition is then to be given with define()).
  std::pair<std::string, bool> name(std::type_index type, std::string_view full_name);
  void define(const std::string& name, Json& definition);
};

// Reading. Each refuses a value of another type, or outside its rules, with its line and path.
bool read_boolean(const Reading&, const Node&);
std::int64_t read_signed(const Reading&, const Node&, const Rules&, std::int64_t low, std::int64_t high);
std::uint64_t read_unsigned(const Reading&, const Node&, const Rules&, std::uint64_t high);
double read_number(const Reading&, const Node&, const Rules&);
std::string read_string(const Reading&, const Node&, const Rules&);
std::size_t read_choice(const Reading&, const Node&, const std::vector<std::string_view>& names);
/// The node is a list (or map) whose count of entries is allowed.
void expect_list(const Reading&, const Node&, const Rules&);
void expect_map(const Reading&, const Node&, const Rules&);
void expect_exactly(const Reading&, const Node&, std::size_t count);
void expect_object(const Reading&, const Node&);

// The schema of one value.
void boolean_schema(Json& out);
void signed_schema(Json& out, const Rules&, std::int64_t low, std::int64_t high);
void unsigned_schema(Json& out, const Rules&, std::uint64_t high);
void number_schema(Json& out, const Rules&);
void string_schema(Json& out, const Rules&);
void choice_schema(Json& out, const std::vector<std::string_view>& names);
Json& list_schema(Json& out, std::size_t min_items,
                  std::size_t max_items);   ///< returns the place for the items'
Json& map_schema(Json& out, const Rules&);  ///< returns the place for the values'
void reference_schema(Json& out, const std::string& name);
void annotate(Json& property, std::string_view key, const Rules&);
/// Gives the property its default, where it says something that `plain` (the type's own) does not.
void set_default(Json& property, Json& value, const Json* plain);
std::string root_schema(Schema&, Json& root, const std::string& title);

// Writing.
Json& member(Json& object, std::string_view key);
Json& append(Json& array);
void become_array(Json& out);
void become_object(Json& out);
void write_boolean(Json& out, bool);
void write_signed(Json& out, std::int64_t);
void write_unsigned(Json& out, std::uint64_t);
void write_number(Json& out, double);
void write_string(Json& out, std::string_view);
std::string dump(const Json&);

/// The name of a type as the compiler spells it, namespaces included.
template <class T>
std::string_view type_name() {
  const std::string_view function = __PRETTY_FUNCTION__;
  const std::size_t begin = function.find("T = ") + 4;
  return function.substr(begin, function.find_first_of(";]", begin) - begin);
}

}  // namespace skylight::settings::detail
