#include "service/http/static_files.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/service/http/raw_client.hpp"
#include "tests/service/http/test_server.hpp"

namespace skylight::http {
namespace {

using test::get_request;
using test::RawClient;
using test::TestServer;

TEST(StaticFiles, AreServedWithTypePolicyAndTag) {
  const TestServer server;
  const auto page = RawClient(server.port()).ask(get_request("/"));
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->header("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(page->body, "<!doctype html><title>room</title>");
  EXPECT_NE(page->header("content-security-policy").find("default-src 'self'"), std::string::npos);
  EXPECT_EQ(page->header("x-content-type-options"), "nosniff");
  EXPECT_EQ(page->header("cache-control"), "no-cache");
  EXPECT_FALSE(page->header("etag").empty());
}

TEST(StaticFiles, AreNotSentAgainToAClientThatHasThem) {
  const TestServer server;
  RawClient client(server.port());
  const auto first = client.ask(get_request("/app.js?v=1"));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->body.size(), 300'000U);
  const std::string tag = first->header("etag");
  const auto second = client.ask(get_request("/app.js", "If-None-Match: \"x\", W/" + tag + "\r\n"));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->status, 304);
  EXPECT_EQ(second->header("etag"), tag);
  EXPECT_EQ(second->header("content-length"), "");
  const auto third = client.ask(get_request("/app.js", "If-None-Match: \"x\"\r\n"));
  ASSERT_TRUE(third);
  EXPECT_EQ(third->status, 200);
}

TEST(StaticFiles, AnswerHeadWithTheLengthAndNoBody) {
  const TestServer server;
  RawClient client(server.port());
  const auto head = client.ask("HEAD /app.js HTTP/1.1\r\nHost: localhost\r\n\r\n", true);
  ASSERT_TRUE(head);
  EXPECT_EQ(head->header("content-length"), "300000");
  const auto next = client.ask(get_request("/api/echo/1"));  // a body would be taken for this answer
  ASSERT_TRUE(next);
  EXPECT_EQ(next->status, 200);
}

TEST(StaticFiles, TakeNoOtherMethods) {
  const TestServer server;
  const auto answer = RawClient(server.port()).ask(test::write_request("POST", "/app.js", "{}"));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 405);
  EXPECT_EQ(answer->header("allow"), "GET, HEAD, OPTIONS");
}

TEST(StaticFiles, AreOnlyThoseThatWereGiven) {
  const TestServer server;
  for (const char* path : {"/etc/passwd", "/app.jsx", "/app.js/", "//app.js", "/index.html"}) {
    const auto answer = RawClient(server.port()).ask(get_request(path));
    ASSERT_TRUE(answer) << path;
    EXPECT_EQ(answer->status, 404) << path;
  }
}

TEST(StaticFiles, OfDifferentContentHaveDifferentTags) {
  const StaticFiles files(
      {{"/a", "text/plain", "one"}, {"/b", "text/plain", "eno"}, {"/c", "text/plain", "one"}});
  const auto tag = [&](const char* path) { return files.find(path, "")->reply.headers.at(0).second; };
  EXPECT_NE(tag("/a"), tag("/b"));
  EXPECT_EQ(tag("/a"), tag("/c"));
}

TEST(StaticFiles, AreRefusedTwiceAndWithoutASlash) {
  EXPECT_THROW(StaticFiles({{"/a", "text/plain", ""}, {"/a", "text/plain", ""}}), std::invalid_argument);
  EXPECT_THROW(StaticFiles({{"a", "text/plain", ""}}), std::invalid_argument);
}

TEST(EntityTag, IsFoundInAListWeakOrByTheStar) {
  EXPECT_TRUE(names_etag("\"a\"", "\"a\""));
  EXPECT_TRUE(names_etag("\"b\" , W/\"a\"", "\"a\""));
  EXPECT_TRUE(names_etag("*", "\"a\""));
  EXPECT_FALSE(names_etag("", "\"a\""));
  EXPECT_FALSE(names_etag("\"aa\", a", "\"a\""));
}

}  // namespace
}  // namespace skylight::http
