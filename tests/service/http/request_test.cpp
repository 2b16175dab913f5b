// What a well-formed request gets: routes, methods, bodies, the checks of writes, headers of answers.
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/service/http/raw_client.hpp"
#include "tests/service/http/test_server.hpp"

namespace skylight::http {
namespace {

using nlohmann::json;
using test::Answer;
using test::get_request;
using test::RawClient;
using test::TestServer;
using test::write_request;

class Api : public testing::Test {
 protected:
  Answer ask(const std::string& bytes, bool head_only = false) {
    const auto answer = RawClient(server_.port()).ask(bytes, head_only);
    EXPECT_TRUE(answer) << bytes.substr(0, 200);
    return answer.value_or(Answer{});
  }
  void expect_problem(const std::string& bytes, int status) {
    const Answer answer = ask(bytes);
    EXPECT_EQ(answer.status, status) << bytes.substr(0, 200) << answer.body;
    EXPECT_EQ(answer.header("content-type"), "application/problem+json") << bytes.substr(0, 200);
    const json body = json::parse(answer.body, nullptr, false);
    ASSERT_TRUE(body.is_object()) << answer.body;
    EXPECT_EQ(body.value("status", 0), status);
    EXPECT_FALSE(body.value("title", "").empty());
    EXPECT_FALSE(body.value("detail", "").empty());
  }

  TestServer server_;
};

TEST_F(Api, BringsPathQueryAndAllowedHeadersToTheHandler) {
  const Answer answer =
      ask(get_request("/api/echo/r%207?at=1.5&k=a%3D%3D&k=b&w=x=y?z&p=50%25",
                      "Accept: text/csv;q=0.5%20\r\nIF-MATCH: \"1\"\r\nAccept-Encoding: br\r\n"
                      "Range: bytes=0-1\r\nCookie: a=b\r\nREMOTE_ADDR: 6.6.6.6\r\n"));
  ASSERT_EQ(answer.status, 200);
  const json body = json::parse(answer.body);
  EXPECT_EQ(body["method"], "GET");
  EXPECT_EQ(body["path"], "/api/echo/r 7");
  EXPECT_EQ(body["path_params"], (json{{"id", "r 7"}}));
  EXPECT_EQ(body["query"], (json{{"at", {"1.5"}}, {"k", {"a==", "b"}}, {"w", {"x=y?z"}}, {"p", {"50%"}}}));
  EXPECT_EQ(body["headers"], (json{{"accept", "text/csv;q=0.5%20"}, {"if-match", "\"1\""}}));
  EXPECT_EQ(body["remote_address"], "127.0.0.1");
}

TEST_F(Api, GivesEveryAnswerTheSafeHeaders) {
  for (const char* path : {"/api/echo/1", "/nowhere", "/", "/api/throw/standard"}) {
    const Answer answer = ask(get_request(path));
    EXPECT_EQ(answer.header("x-content-type-options"), "nosniff") << path;
    EXPECT_EQ(answer.header("referrer-policy"), "no-referrer") << path;
    EXPECT_EQ(answer.headers.count("content-security-policy"), 1U) << path;
    EXPECT_EQ(answer.headers.count("content-length"), 1U) << path;
    EXPECT_EQ(answer.header("keep-alive"), "") << path;
    EXPECT_EQ(answer.header("date").size(), 29U) << path;
  }
  EXPECT_EQ(ask(get_request("/api/echo/1")).header("cache-control"), "no-store");
}

TEST_F(Api, LetsARouteSetItsOwnHeadersButNotTheFramingNorBrokenLines) {
  const Answer answer = ask(get_request("/api/own"));
  EXPECT_EQ(answer.header("cache-control"), "max-age=5");
  EXPECT_EQ(answer.headers.count("cache-control"), 1U);
  EXPECT_EQ(answer.header("etag"), "\"7\"");
  EXPECT_EQ(answer.header("content-type"), "text/csv");
  EXPECT_EQ(answer.header("content-length"), "4");
  EXPECT_EQ(answer.headers.count("content-length"), 1U);
  EXPECT_EQ(answer.headers.count("x-bad"), 0U);
  EXPECT_EQ(answer.headers.count("x-smuggled"), 0U);
}

TEST_F(Api, AnswersHeadAsGetWithoutTheBody) {
  RawClient client(server_.port());
  const auto head = client.ask("HEAD /api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n", true);
  ASSERT_TRUE(head);
  EXPECT_EQ(head->status, 200);
  const auto get = client.ask(get_request("/api/echo/1"));
  ASSERT_TRUE(get);
  EXPECT_EQ(head->header("content-length"), get->header("content-length"));
  EXPECT_EQ(head->header("accept-ranges"), "");
  EXPECT_EQ(json::parse(get->body)["method"], "GET");
}

TEST_F(Api, TellsAnUnknownPathFromAWrongMethodAndNamesTheRightOnes) {
  expect_problem(get_request("/api/nowhere"), 404);
  expect_problem(get_request("/api/echo/"), 404);
  expect_problem(write_request("PATCH", "/api/echo", "{}"), 405);
  EXPECT_EQ(ask(write_request("PATCH", "/api/echo", "{}")).header("allow"), "POST, PUT, OPTIONS");
  expect_problem("TRACE /api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n", 405);
  expect_problem("BREW /api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n", 405);
}

TEST_F(Api, AnswersOptionsWithTheMethods) {
  const Answer answer = ask("OPTIONS /api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(answer.status, 204);
  EXPECT_EQ(answer.header("allow"), "DELETE, GET, HEAD, OPTIONS");
  EXPECT_EQ(answer.headers.count("content-length"), 0U);
  EXPECT_EQ(ask("OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 204);
}

TEST_F(Api, AnswersNoContentWithoutLengthAndGoesOn) {
  RawClient client(server_.port());
  const auto empty = client.ask(get_request("/api/empty"));
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->status, 204);
  EXPECT_EQ(empty->headers.count("content-length"), 0U);
  EXPECT_EQ(empty->headers.count("content-type"), 0U);
  EXPECT_TRUE(client.ask(get_request("/api/echo/1")));
}

TEST_F(Api, TurnsWhateverAHandlerThrowsIntoAProblemThatKeepsItsSecrets) {
  expect_problem(get_request("/api/throw/problem"), 422);
  EXPECT_EQ(json::parse(ask(get_request("/api/throw/problem")).body)["title"], "Out of range");
  for (const char* how : {"standard", "number", "status"}) {
    const std::string request = get_request(std::string("/api/throw/") + how);
    expect_problem(request, 500);
    const Answer answer = ask(request);
    EXPECT_EQ(answer.body.find("secret"), std::string::npos);
    EXPECT_EQ(answer.headers.count("exception_what"), 0U);
  }
  EXPECT_NE(server_.log().find("GET /api/throw/standard: the secret  of the handler\n"), std::string::npos);
  expect_problem(get_request("/api/throw/empty-error"), 404);
}

TEST_F(Api, TakesBodiesAboveEightKilobytesOfAnyDeclaredType) {
  const std::string json_body(40'000, ' ');
  EXPECT_EQ(json::parse(ask(write_request("POST", "/api/echo", json_body)).body)["body_bytes"], 40'000);
  const std::string form(40'000, 'f');  // the type that plain `curl -d` names
  const Answer answer =
      ask(write_request("POST", "/api/form", form, "Content-Type: application/x-www-form-urlencoded\r\n"));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(json::parse(answer.body)["body_bytes"], 40'000);
  EXPECT_EQ(json::parse(answer.body).count("query"), 0U);
}

TEST_F(Api, TakesChunkedBodies) {
  const Answer answer =
      ask("POST /api/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json; charset=utf-8\r\n"
          "Transfer-Encoding: Chunked\r\n\r\n5;ext=1\r\n{\"a\":\r\n2\r\n1}\r\n0\r\nX-Trailer: 1\r\n\r\n");
  ASSERT_EQ(answer.status, 200);
  EXPECT_EQ(json::parse(answer.body)["body"], "{\"a\":1}");
}

TEST_F(Api, TakesNoHeadersFromTrailers) {
  const Answer answer =
      ask("POST /api/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
          "Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\nIf-Match: \"9\"\r\n\r\n");
  ASSERT_EQ(answer.status, 200);
  EXPECT_EQ(json::parse(answer.body)["headers"].count("if-match"), 0U);
}

TEST_F(Api, SaysContinueBeforeABodyThatWaitsForIt) {
  RawClient client(server_.port());
  const std::string head =
      "POST /api/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Expect: 100-Continue\r\nContent-Length: 2\r\n\r\n";
  const auto go_on = client.ask(head);
  ASSERT_TRUE(go_on);
  EXPECT_EQ(go_on->status, 100);
  const auto answer = client.ask("{}");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
}

TEST_F(Api, RefusesAWaitingBodyBeforeItIsSent) {
  const auto refused = [&](const std::string& more, int status) {
    expect_problem("POST /api/echo HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\n" + more + "\r\n",
                   status);
  };
  refused("Content-Type: application/json\r\nContent-Length: 99999999\r\n", 413);
  refused("Content-Type: text/plain\r\nContent-Length: 5\r\n", 415);
}

TEST_F(Api, HoldsEachRouteToItsOwnBoundOfTheBody) {
  const std::string type = "Content-Type: image/png\r\n";
  EXPECT_EQ(ask(write_request("PUT", "/api/picture", std::string(3'000'000, 'p'), type)).status, 200);
  expect_problem(write_request("PUT", "/api/picture", std::string(4'194'305, 'p'), type), 413);
  expect_problem(write_request("PUT", "/api/echo", std::string(1'048'577, ' ')), 413);
}

TEST_F(Api, CutsAChunkedBodyAtTheBound) {
  std::string bytes =
      "POST /api/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Transfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 20; ++i) bytes += "10000\r\n" + std::string(65'536, ' ') + "\r\n";
  expect_problem(bytes + "0\r\n\r\n", 413);
}

TEST_F(Api, TakesAWriteOnlyFromPagesOfItsOwnAndFromPrograms) {
  const std::string json_type = "Content-Type: application/json\r\n";
  const auto status = [&](const std::string& more) {
    return ask(write_request("POST", "/api/echo", "{}", json_type + more)).status;
  };
  EXPECT_EQ(status(""), 200);
  EXPECT_EQ(status("Origin: http://localhost\r\n"), 200);
  EXPECT_EQ(status("Origin: http://localhost:80\r\n"), 200);
  EXPECT_EQ(status("Sec-Fetch-Site: same-origin\r\n"), 200);
  EXPECT_EQ(status("Origin: http://evil.example\r\n"), 403);
  EXPECT_EQ(status("Origin: http://localhost:3000\r\n"), 403);
  EXPECT_EQ(status("Origin: http://localhost.evil.example\r\n"), 403);
  EXPECT_EQ(status("Origin: null\r\n"), 403);
  EXPECT_EQ(status("Origin: localhost\r\n"), 403);
  EXPECT_EQ(status("Origin:\r\n"), 403);
  EXPECT_EQ(status("Sec-Fetch-Site: cross-site\r\n"), 403);
  EXPECT_EQ(status("Origin: http://localhost\r\nOrigin: http://evil.example\r\n"), 400);
  expect_problem("DELETE /api/echo/1 HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n",
                 403);
  EXPECT_EQ(ask("DELETE /api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 200);
}

TEST_F(Api, TakesOnlyTheContentTypesOfTheRoute) {
  const auto refused = [&](const std::string& more) {
    expect_problem(write_request("POST", "/api/echo", "{}", more), 415);
  };
  refused("");
  refused("Content-Type: text/plain\r\n");
  refused("Content-Type: application/x-www-form-urlencoded\r\n");
  refused("Content-Type: multipart/form-data; boundary=x\r\n");
  refused("Content-Type: text/plain; application/json\r\n");
  EXPECT_EQ(ask(write_request("POST", "/api/echo", "{}", "Content-Type: Application/JSON;charset=utf-8\r\n"))
                .status,
            200);
  EXPECT_EQ(ask(write_request("POST", "/api/echo", "", "")).status, 200);
}

TEST_F(Api, AnswersOnlyToNamesThatAreItsOwn) {
  const auto status = [&](const std::string& host) {
    return ask("GET /api/echo/1 HTTP/1.1\r\n" + host + "\r\n").status;
  };
  EXPECT_EQ(status("Host: localhost\r\n"), 200);
  EXPECT_EQ(status("Host: LocalHost:" + std::to_string(server_.port()) + "\r\n"), 200);
  EXPECT_EQ(status("Host: 127.0.0.1:9\r\n"), 200);
  EXPECT_EQ(status("Host: [::1]:8080\r\n"), 200);
  EXPECT_EQ(status("Host: evil.example\r\n"), 421);
  EXPECT_EQ(status("Host: localhost.evil.example\r\n"), 421);
  EXPECT_EQ(status("Host: 10.0.0.1\r\n"), 421);
  EXPECT_EQ(status(""), 400);
  EXPECT_EQ(status("Host:\r\n"), 400);
  EXPECT_EQ(status("Host: localhost\r\nHost: localhost\r\n"), 400);
  EXPECT_EQ(status("Host: localhost:80:80\r\n"), 400);
  EXPECT_EQ(status("Host: localhost:x\r\n"), 400);
  EXPECT_EQ(status("Host: [::1\r\n"), 400);
}

TEST_F(Api, TakesTheAbsoluteFormOfATargetOnlyForItsOwnName) {
  EXPECT_EQ(ask("GET http://localhost/api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 200);
  expect_problem("GET http://evil.example/api/echo/1 HTTP/1.1\r\nHost: localhost\r\n\r\n", 421);
}

TEST(AllowedNames, AreTakenBesideTheLoopbackOnes) {
  const TestServer server(
      {.allowed_hosts = {"Lab.example"}, .allowed_origins = {"https://panel.example:8443"}});
  const auto status = [&](const std::string& origin) {
    const auto answer = RawClient(server.port())
                            .ask(
                                "POST /api/echo HTTP/1.1\r\nHost: lab.example:443\r\nContent-Length: 2\r\n"
                                "Content-Type: application/json\r\nOrigin: " +
                                origin + "\r\n\r\n{}");
    return answer ? answer->status : 0;
  };
  EXPECT_EQ(status("https://panel.example:8443"), 200);
  EXPECT_EQ(status("https://lab.example"), 200);
  EXPECT_EQ(status("http://lab.example"), 403);
  EXPECT_EQ(status("https://panel.example"), 403);
}

}  // namespace
}  // namespace skylight::http
