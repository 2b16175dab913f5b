// The page's files, from memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/http/message.hpp"
#include "service/http/server.hpp"

namespace skylight::http {

class StaticFiles {
 public:
  /// Throws std::invalid_argument for two files of one path and for a path that does not begin with '/'.
  explicit StaticFiles(std::vector<StaticFile> files);

  struct Found {
    Reply reply;            ///< status and headers; its own body stays empty
    std::string_view body;  ///< lives as long as this object; empty for 304
  };
  bool has(std::string_view path) const { return files_.find(path) != files_.end(); }
  /// None for a path that is no file. `if_none_match`: the header's value, empty where it is absent.
  std::optional<Found> find(std::string_view path, std::string_view if_none_match) const;

 private:
  struct Entry {
    StaticFile file;
    std::string etag;  ///< with its quotes
  };
  std::map<std::string, Entry, std::less<>> files_;
};

/// True where `if_none_match` ("*" or a list of tags, weak ones too) names `etag` (RFC 9110, 13.1.2).
bool names_etag(std::string_view if_none_match, std::string_view etag);

}  // namespace skylight::http
