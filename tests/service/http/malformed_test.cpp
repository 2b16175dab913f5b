// Requests that no client of good faith sends: each is answered with a problem of the 400s or cut, and the
// server goes on.
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/service/http/raw_client.hpp"
#include "tests/service/http/test_server.hpp"

namespace skylight::http {
namespace {

using test::get_request;
using test::RawClient;
using test::TestServer;

constexpr int kCut = 0;  // closed without an answer

struct Malformed {
  const char* what;
  std::string bytes;
  int status;
};

const std::string kHost = "Host: localhost\r\n";
const std::string kJson = "Content-Type: application/json\r\n";
const std::string kPost = "POST /api/echo HTTP/1.1\r\n" + kHost + kJson;
const std::string kChunks = kPost + "Transfer-Encoding: chunked\r\n\r\n";

std::vector<Malformed> bad_request_lines() {
  return {
      {"only an empty line", "\r\n\r\n", 400},
      {"no target", "GET HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"no version", "GET /\r\n" + kHost + "\r\n", 400},
      {"version 0.9", "GET / HTTP/0.9\r\n" + kHost + "\r\n", 400},
      {"version 2.0", "GET / HTTP/2.0\r\n" + kHost + "\r\n", 400},
      {"version 1.2", "GET / HTTP/1.2\r\n" + kHost + "\r\n", 400},
      {"another protocol", "GET / FTP/1.1\r\n" + kHost + "\r\n", 400},
      {"the preface of HTTP/2", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400},
      {"a TLS greeting", std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xFC\x03\x03", 11), 400},
      {"zeros", std::string(64, '\0'), 400},
      {"a space before the method", " GET / HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"two spaces before the target", "GET  / HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"words after the version", "GET / HTTP/1.1 now\r\n" + kHost + "\r\n", 400},
      {"a method with a colon", "GE:T / HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"a line feed alone", "GET / HTTP/1.1\n" + kHost + "\n", 400},
      {"a tab in the target", "GET /a\tb HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"CONNECT", "CONNECT localhost:80 HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"a star for GET", "GET * HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"a target without its slash", "GET api HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"a foreign absolute target", "GET http://evil.example/ HTTP/1.1\r\n" + kHost + "\r\n", 421},
      {"an absolute target of another scheme", "GET ftp://localhost/ HTTP/1.1\r\n" + kHost + "\r\n", 400},
  };
}

std::vector<Malformed> bad_targets() {
  std::vector<Malformed> all;
  for (const char* target :
       {"/a%2Fb", "/a%2f", "/%00", "/a?b=%00", "/%0d%0aX:1", "/%7f", "/%zz", "/%1", "/%", "/%u0041", "/a#b",
        "/../etc/passwd", "/%2e%2e/etc", "/./", "/%ff", "/%c0%af", "/\xC3\xA4"}) {
    all.push_back({target, get_request(target), 400});
  }
  all.push_back({"an overlong target", get_request('/' + std::string(5000, 'a')), 414});
  all.push_back({"an overlong query", get_request("/?" + std::string(5000, '?')), 414});
  all.push_back({"an endless target", "GET /" + std::string(60'000, 'a'), 414});
  return all;
}

std::vector<Malformed> bad_headers() {
  std::string many = "GET / HTTP/1.1\r\n" + kHost;
  for (int i = 0; i < 4000; ++i) many += "X-" + std::to_string(i) + ": 1\r\n";
  return {
      {"no Host", "GET / HTTP/1.1\r\n\r\n", 400},
      {"two Hosts", get_request("/", kHost), 400},
      {"a foreign Host", "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", 421},
      {"a Host with a path", "GET / HTTP/1.1\r\nHost: localhost/x\r\n\r\n", 421},
      {"a Host with a user", "GET / HTTP/1.1\r\nHost: localhost@evil\r\n\r\n", 421},
      {"a header without a colon", get_request("/", "nonsense\r\n"), 400},
      {"a space before the colon", get_request("/", "X-A : 1\r\n"), 400},
      {"a header without a name", get_request("/", ": 1\r\n"), 400},
      {"a control character in a value", get_request("/", "X-A: a\x01z\r\n"), 400},
      {"a zero in a value", get_request("/", std::string("X-A: a\0z\r\n", 10)), 400},
      {"a line feed alone in a value", get_request("/", "X-A: a\nX-B: b\r\n"), 400},
      {"too many headers", many + "\r\n", 431},
      {"an overlong value", get_request("/", "X-A: " + std::string(40'000, 'a') + "\r\n"), 431},
      {"an endless value", "GET / HTTP/1.1\r\n" + kHost + "X-A: " + std::string(60'000, 'a'), 431},
      {"an overlong passed header", get_request("/api/echo/1", "Accept: " + std::string(3000, '%') + "\r\n"),
       431},
      {"a passed header twice", get_request("/api/echo/1", "If-Match: 1\r\nIf-Match: 2\r\n"), 400},
      {"an unknown expectation", kPost + "Expect: tea\r\nContent-Length: 2\r\n\r\n{}", 417},
  };
}

std::vector<Malformed> bad_framing() {
  return {
      {"a negative length", kPost + "Content-Length: -1\r\n\r\n", 400},
      {"a length in words", kPost + "Content-Length: two\r\n\r\n{}", 400},
      {"a length with a sign", kPost + "Content-Length: +2\r\n\r\n{}", 400},
      {"a length with a tail", kPost + "Content-Length: 2x\r\n\r\n{}", 400},
      {"a length beyond 64 bits", kPost + "Content-Length: 99999999999999999999999\r\n\r\n", 400},
      {"a length of 64 bits", kPost + "Content-Length: 18446744073709551615\r\n\r\n", 413},
      {"two lengths", kPost + "Content-Length: 2\r\nContent-Length: 3\r\n\r\n{}", 400},
      {"the same length twice", kPost + "Content-Length: 2\r\nContent-Length: 2\r\n\r\n{}", 400},
      {"a list of lengths", kPost + "Content-Length: 2, 2\r\n\r\n{}", 400},
      {"a length and chunks", kPost + "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
       400},
      {"chunks and a length", kPost + "Transfer-Encoding: chunked\r\nContent-Length: 2\r\n\r\n0\r\n\r\n",
       400},
      {"gzip", kPost + "Transfer-Encoding: gzip\r\n\r\n", 400},
      {"gzip, then chunks", kPost + "Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n", 400},
      {"identity", kPost + "Transfer-Encoding: identity\r\nContent-Length: 2\r\n\r\n{}", 400},
      {"chunks twice", kPost + "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
       400},
      {"nearly chunks", kPost + "Transfer-Encoding: xchunked\r\n\r\n0\r\n\r\n", 400},
      {"chunks of HTTP/1.0",
       "POST /api/echo HTTP/1.0\r\n" + kHost + kJson + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400},
      {"a chunk size in words", kChunks + "ten\r\n", 400},
      {"a negative chunk size", kChunks + "-1\r\n\r\n", 400},
      {"a chunk size beyond 64 bits", kChunks + "FFFFFFFFFFFFFFFFF\r\n", 400},
      {"an enormous chunk", kChunks + "FFFFFFFFFFFFFFFF\r\n", 413},
      {"a chunk longer than it says", kChunks + "1\r\n{}\r\n0\r\n\r\n", 400},
      {"an endless chunk extension", kChunks + "2;" + std::string(60'000, 'e'), 431},
      {"endless trailers", kChunks + "0\r\nX-A: " + std::string(60'000, 't'), 431},
      {"a body for GET", get_request("/api/echo/1", "Content-Length: 2\r\n") + "{}", 400},
      {"a body that is too long", kPost + "Content-Length: 2000000\r\n\r\n", 413},
  };
}

void expect_answered_or_cut(const TestServer& server, const Malformed& request) {
  RawClient client(server.port());
  client.send(request.bytes);
  const auto answer = client.read_answer();
  EXPECT_EQ(answer ? answer->status : kCut, request.status) << request.what;
  if (!answer) return;
  EXPECT_EQ(answer->header("content-type"), "application/problem+json") << request.what;
  const auto body = nlohmann::json::parse(answer->body, nullptr, false);
  ASSERT_TRUE(body.is_object()) << request.what << ": " << answer->body;
  EXPECT_EQ(body.value("status", 0), answer->status) << request.what;
  EXPECT_FALSE(body.value("detail", "").empty()) << request.what;
}

void expect_all(const std::vector<Malformed>& requests) {
  const TestServer server;
  for (const Malformed& request : requests) {
    expect_answered_or_cut(server, request);
    const auto alive = RawClient(server.port()).ask(get_request("/api/echo/1"));
    ASSERT_TRUE(alive) << "after " << request.what;
    EXPECT_EQ(alive->status, 200) << "after " << request.what;
  }
}

TEST(MalformedRequests, WithABadRequestLineAreAnsweredOrCut) {
  expect_all(bad_request_lines());
}
TEST(MalformedRequests, WithABadTargetAreAnsweredOrCut) {
  expect_all(bad_targets());
}
TEST(MalformedRequests, WithBadHeadersAreAnsweredOrCut) {
  expect_all(bad_headers());
}
TEST(MalformedRequests, WithBadFramingAreAnsweredOrCut) {
  expect_all(bad_framing());
}

TEST(MalformedRequests, AreManyEnoughToBeWorthTheirTable) {
  EXPECT_GE(bad_request_lines().size() + bad_targets().size() + bad_headers().size() + bad_framing().size(),
            48U);
}

TEST(MalformedRequests, EndTheConnectionSoThatNothingHidesBehindThem) {
  const TestServer server;
  for (const auto& requests : {bad_request_lines(), bad_framing()}) {
    for (const Malformed& request : requests) {
      if (request.status != 400) continue;
      RawClient client(server.port());
      client.send(request.bytes + get_request("/api/echo/smuggled"));
      const auto answer = client.read_answer();
      EXPECT_EQ(answer ? answer->status : kCut, 400) << request.what;
      EXPECT_FALSE(client.read_answer()) << request.what;
    }
  }
}

TEST(MalformedRequests, AreCutWhereThePeerLeavesInTheMiddle) {
  const TestServer server;
  for (const std::string& whole : {get_request("/api/echo/1"), kPost + "Content-Length: 20\r\n\r\n{}"}) {
    for (std::size_t length = 1; length < whole.size(); length += 7) {
      RawClient client(server.port());
      client.send(whole.substr(0, length));
      client.finish_sending();
      EXPECT_TRUE(client.ends()) << whole.substr(0, length);
    }
  }
  EXPECT_TRUE(RawClient(server.port()).ask(get_request("/api/echo/1")));
}

}  // namespace
}  // namespace skylight::http
