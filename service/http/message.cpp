#include "service/http/message.hpp"

#include <array>
#include <cstdint>
#include <utility>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

void append_escaped(std::string& out, unsigned char c) {
  constexpr std::string_view kHex = "0123456789abcdef";
  switch (c) {
    case '"':
      out += "\\\"";
      return;
    case '\\':
      out += "\\\\";
      return;
    case '\n':
      out += "\\n";
      return;
    case '\r':
      out += "\\r";
      return;
    case '\t':
      out += "\\t";
      return;
    default:
      break;
  }
  if (c < 0x20 || c == 0x7F) {
    out += "\\u00";
    out += kHex[c >> 4U];
    out += kHex[c & 0xFU];
  } else {
    out += static_cast<char>(c);
  }
}

void append_member(std::string& out, std::string_view name, std::string_view json) {
  out += out.size() > 1 ? "," : "";
  out += json_quote(name);
  out += ':';
  out += json;
}

}  // namespace

const std::string* Request::query_value(const std::string& name) const {
  const auto found = query.lower_bound(name);
  return found == query.end() || found->first != name ? nullptr : &found->second;
}

const std::string* Request::header(const std::string& lower_case_name) const {
  const auto found = headers.find(lower_case_name);
  return found == headers.end() ? nullptr : &found->second;
}

std::string json_quote(std::string_view text) {
  std::string out = "\"";
  out.reserve(text.size() + 2);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text.substr(at));
    if (length == 0) {
      out += kReplacement;
      ++at;
    } else if (length == 1) {
      append_escaped(out, static_cast<unsigned char>(text[at++]));
    } else {
      out += text.substr(at, length);
      at += length;
    }
  }
  return out + '"';
}

Reply problem(const ProblemDetails& details) {
  std::string body = "{";
  append_member(body, "type", json_quote(details.type));
  append_member(body, "title",
                json_quote(details.title.empty() ? status_words(details.status) : details.title));
  append_member(body, "status", std::to_string(details.status));
  append_member(body, "detail", json_quote(details.detail));
  if (!details.instance.empty()) append_member(body, "instance", json_quote(details.instance));
  for (const auto& [name, json] : details.members) append_member(body, name, json);
  return {.status = details.status, .content_type = "application/problem+json", .body = body + "}\n"};
}

Reply problem(int status, std::string title, std::string detail) {
  return problem({.status = status, .title = std::move(title), .detail = std::move(detail)});
}

std::string_view status_words(int status) {
  switch (status) {
    case 100:
      return "Continue";
    case 200:
      return "OK";
    case 201:
      return "Created";
    case 202:
      return "Accepted";
    case 204:
      return "No Content";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 409:
      return "Conflict";
    case 412:
      return "Precondition Failed";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 417:
      return "Expectation Failed";
    case 421:
      return "Misdirected Request";
    case 422:
      return "Unprocessable Content";
    case 428:
      return "Precondition Required";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    default:
      return "Unknown";
  }
}

}  // namespace skylight::http
