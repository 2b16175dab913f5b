#include "service/http/static_files.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

constexpr const char* kPagePolicy =
    "default-src 'self'; img-src 'self' data: blob:; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'; object-src 'none'";

// FNV-1a, 64 bits (RFC draft-eastlake-fnv): tells one build's file from the next one's, not more.
std::string etag_of(std::string_view body) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : body) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "\"%016llx-%zx\"", static_cast<unsigned long long>(hash),
                body.size());
  return text.data();
}

}  // namespace

bool names_etag(std::string_view if_none_match, std::string_view etag) {
  while (!if_none_match.empty()) {
    std::string_view tag = if_none_match.substr(0, if_none_match.find(','));
    if_none_match.remove_prefix(std::min(tag.size() + 1, if_none_match.size()));
    tag = trim(tag);
    if (tag.substr(0, 2) == "W/") tag.remove_prefix(2);
    if (tag == "*" || tag == etag) return true;
  }
  return false;
}

StaticFiles::StaticFiles(std::vector<StaticFile> files) {
  for (StaticFile& file : files) {
    if (file.path.empty() || file.path.front() != '/') {
      throw std::invalid_argument("static file \"" + file.path + "\": the path must begin with '/'");
    }
    std::string path = file.path;
    std::string etag = etag_of(file.body);
    if (!files_.emplace(path, Entry{std::move(file), std::move(etag)}).second) {
      throw std::invalid_argument("static file \"" + path + "\": it is there twice");
    }
  }
}

std::optional<StaticFiles::Found> StaticFiles::find(std::string_view path,
                                                    std::string_view if_none_match) const {
  const auto found = files_.find(path);
  if (found == files_.end()) return std::nullopt;
  const auto& [file, etag] = found->second;
  const bool unchanged = names_etag(if_none_match, etag);
  Found answer{.reply = {.status = unchanged ? 304 : 200,
                         .headers = {{"ETag", etag}, {"Cache-Control", file.cache_control}}},
               .body = unchanged ? std::string_view() : std::string_view(file.body)};
  answer.reply.content_type = file.content_type;
  const bool html = file.content_type.rfind("text/html", 0) == 0;
  if (html) answer.reply.headers.emplace_back("Content-Security-Policy", kPagePolicy);
  return answer;
}

}  // namespace skylight::http
