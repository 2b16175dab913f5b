// The server as a whole: connections, lanes, limits, starting and stopping.
#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/service/http/raw_client.hpp"
#include "tests/service/http/test_server.hpp"

namespace skylight::http {
namespace {

using nlohmann::json;
using test::get_request;
using test::RawClient;
using test::TestServer;
using test::write_request;

TEST(Connections, AreKeptForManyRequests) {
  const TestServer server;
  RawClient client(server.port());
  for (int i = 0; i < 300; ++i) {
    const auto answer = client.ask(get_request("/api/echo/" + std::to_string(i)));
    ASSERT_TRUE(answer) << i;
    ASSERT_EQ(json::parse(answer->body)["path_params"]["id"], std::to_string(i));
    ASSERT_EQ(answer->header("connection"), "");
  }
}

TEST(Connections, AnswerPipelinedRequestsInTheirOrder) {
  TestServer server;
  std::string all = get_request("/api/wait");
  for (int i = 0; i < 50; ++i) {
    all += i % 3 == 0 ? get_request("/app.js") : get_request("/api/echo/" + std::to_string(i));
    all += write_request("POST", "/api/echo", std::to_string(i));
  }
  RawClient client(server.port());
  client.send(all);
  server.barrier().wait_until_inside(1);  // the first is still at work when the others have been sent
  server.barrier().open();
  ASSERT_TRUE(client.read_answer());
  for (int i = 0; i < 50; ++i) {
    const auto get = client.read_answer();
    const auto post = client.read_answer();
    ASSERT_TRUE(get && post) << i;
    if (i % 3 == 0) {
      EXPECT_EQ(get->body.size(), 300'000U);
    } else {
      EXPECT_EQ(json::parse(get->body)["path_params"]["id"], std::to_string(i));
    }
    EXPECT_EQ(json::parse(post->body)["body"], std::to_string(i));
  }
}

TEST(Connections, CloseWhenTheClientSaysSo) {
  const TestServer server;
  for (const std::string& request :
       {get_request("/api/echo/1", "Connection: close\r\n"), get_request("/", "Connection: close\r\n"),
        std::string("GET /api/echo/1 HTTP/1.0\r\nHost: localhost\r\n\r\n")}) {
    RawClient client(server.port());
    const auto answer = client.ask(request);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
    EXPECT_EQ(answer->header("connection"), "close");
    EXPECT_TRUE(client.ends());
  }
}

TEST(Connections, OfHttp10AreKeptWhenAskedTo) {
  const TestServer server;
  RawClient client(server.port());
  for (const char* path : {"/api/echo/1", "/"}) {
    const auto answer = client.ask(std::string("GET ") + path +
                                   " HTTP/1.0\r\nHost: localhost\r\nConnection: keep-alive\r\n\r\n");
    ASSERT_TRUE(answer) << path;
    EXPECT_EQ(answer->header("connection"), "keep-alive") << path;
  }
}

TEST(Connections, GoOnAfterARefusalThatLeavesNothingUnread) {
  const TestServer server;
  RawClient client(server.port());
  EXPECT_EQ(client.ask(get_request("/nowhere"))->status, 404);
  EXPECT_EQ(client.ask("DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n")->status, 405);
  EXPECT_EQ(client.ask(get_request("/api/echo/1"))->status, 200);
}

TEST(Connections, CarryBigAnswersToTheirEnd) {
  const TestServer server;
  RawClient client(server.port());
  for (int i = 0; i < 2; ++i) {
    const auto answer = client.ask(get_request("/api/big"));
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->body, std::string(8U * 1024 * 1024, 'b'));
  }
}

TEST(Connections, GetTheirRefusalEvenWhileTheyStillSend) {
  const TestServer server;
  for (int round = 0; round < 5; ++round) {
    RawClient client(server.port());
    // All is taken and thrown away: a reset in the middle could cost the client the answer.
    EXPECT_TRUE(client.send(write_request("PUT", "/api/echo", std::string(20'000'000, 'x'))));
    const auto answer = client.read_answer();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 413);
    client.finish_sending();
    EXPECT_TRUE(client.ends());
  }
}

TEST(Server, ServesSeveralClientsFromSeveralThreads) {
  const TestServer server;
  std::atomic<int> right{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&, t] {
      RawClient client(server.port());
      for (int i = 0; i < 50; ++i) {
        const std::string text = std::to_string(t) + '.' + std::to_string(i);
        const auto answer = client.ask(write_request("PUT", "/api/echo?x=" + text, text));
        if (answer && json::parse(answer->body)["body"] == text) ++right;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, 8 * 50);
}

TEST(Lanes, RefuseSlowWorkBeyondTheQueueAndGoOnWithQuickReads) {
  TestServer server({.slow_threads = 1, .slow_queue = 2});
  std::vector<RawClient> held;
  for (int i = 0; i < 3; ++i) held.emplace_back(server.port()).send(get_request("/api/slow"));
  RawClient probe(server.port());
  // The three may still be on their way; the fourth or a later one finds the lane full.
  std::vector<RawClient> more;
  while (true) {
    more.emplace_back(server.port()).send(get_request("/api/slow"));
    if (more.back().readable_within(200)) break;
    ASSERT_LT(more.size(), 20U);
  }
  const auto full = more.back().read_answer();
  ASSERT_TRUE(full);
  EXPECT_EQ(full->status, 503);
  EXPECT_EQ(full->header("retry-after"), "1");
  EXPECT_EQ(full->header("content-type"), "application/problem+json");
  EXPECT_EQ(probe.ask(get_request("/api/echo/1"))->status, 200);
  EXPECT_EQ(more.back().ask(get_request("/api/echo/1"))->status, 200);  // the connection goes on
  server.barrier().open();
  for (RawClient& client : held) EXPECT_EQ(client.read_answer()->status, 200);
}

TEST(Lanes, ServeFilesWhileEveryWorkerIsBusy) {
  TestServer server({.quick_threads = 1});
  RawClient busy(server.port());
  busy.send(get_request("/api/wait"));
  server.barrier().wait_until_inside(1);
  EXPECT_EQ(RawClient(server.port()).ask(get_request("/"))->status, 200);
  EXPECT_EQ(RawClient(server.port()).ask(get_request("/nowhere"))->status, 404);
  server.barrier().open();
  EXPECT_EQ(busy.read_answer()->status, 200);
}

TEST(Limits, HoldTheSumOfAllBodies) {
  const TestServer server({.max_bodies_bytes = 4U * 1024 * 1024});
  const std::string head = "PUT /api/picture HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n";
  const std::string body(3'000'000, 'p');
  RawClient first(server.port());
  EXPECT_EQ(first.ask(head + "Expect: 100-continue\r\nContent-Length: 3000000\r\n\r\n")->status, 100);
  RawClient second(server.port());
  const auto busy = second.ask(head + "Content-Length: 3000000\r\n\r\n");
  ASSERT_TRUE(busy);
  EXPECT_EQ(busy->status, 503);
  EXPECT_EQ(first.ask(body)->status, 200);
  RawClient third(server.port());
  EXPECT_EQ(third.ask(head + "Content-Length: 3000000\r\n\r\n" + body)->status, 200);
}

TEST(Start, SaysThatThePortIsTaken) {
  const TestServer first;
  Server second({.port = first.port()}, Router(), {});
  try {
    second.start();
    FAIL() << "two servers on one port";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "cannot listen on 127.0.0.1:" + std::to_string(first.port()) + ": Address already in use");
  }
  EXPECT_EQ(RawClient(first.port()).ask(get_request("/"))->status, 200);
}

TEST(Start, SaysThatTheHostIsNotOfThisMachine) {
  for (const char* host : {"192.0.2.1", "no-such-host.invalid", "not a host"}) {
    Server server({.host = host, .port = 0}, Router(), {});
    EXPECT_THROW(server.start(), std::runtime_error) << host;
  }
}

TEST(Start, RefusesOptionsOutsideTheirRanges) {
  const auto refused = [](ServerOptions options) {
    EXPECT_THROW(Server(std::move(options), Router(), {}), std::invalid_argument);
  };
  refused({.quick_threads = 0});
  refused({.slow_threads = 65});
  refused({.max_header_bytes = 100});
  refused({.max_target_bytes = 9000});
  refused({.max_connections = 0});
  refused({.max_bodies_bytes = 1000});
  refused({.deadlines = {.idle = std::chrono::milliseconds(0)}});
}

TEST(Start, RefusesARouteThatTakesMoreThanAllBodiesTogether) {
  Router router;
  router.add("PUT", "/big", [](const Request&) { return Reply{}; }, {.max_body_bytes = 3'000'000});
  EXPECT_THROW(Server({.max_bodies_bytes = 2'000'000}, std::move(router), {}), std::invalid_argument);
}

TEST(Stop, EndsWithConnectionsOpenAndNobodyOnThem) {
  TestServer server;
  std::vector<RawClient> clients;
  for (int i = 0; i < 20; ++i) clients.emplace_back(server.port());
  EXPECT_TRUE(clients[0].ask(get_request("/api/echo/1")));
  clients[1].send("GET / HT");
  server.server().stop();
  for (RawClient& client : clients) EXPECT_TRUE(client.ends());
  EXPECT_THROW(RawClient(server.port()).ask(get_request("/")), std::runtime_error);
}

TEST(Stop, LetsARequestUnderWayFinish) {
  TestServer server({.deadlines = {.stop = std::chrono::seconds(20)}});
  RawClient client(server.port());
  client.send(get_request("/api/wait"));
  server.barrier().wait_until_inside(1);
  std::thread stopping([&] { server.server().stop(); });
  server.barrier().open();
  const auto answer = client.read_answer();
  stopping.join();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  EXPECT_TRUE(client.ends());
}

TEST(Stop, CutsAClientThatDoesNotTakeItsAnswer) {
  TestServer server({.deadlines = {.stop = std::chrono::milliseconds(100)}});
  RawClient client(server.port());
  client.send(get_request("/api/big"));
  EXPECT_TRUE(client.readable_within(20'000));
  server.server().stop();  // the test is that this returns
  EXPECT_TRUE(client.ends());
}

TEST(Stop, MayBeCalledTwiceAndWithoutAStart) {
  Server never({.port = 0}, Router(), {});
  never.stop();
  EXPECT_EQ(never.port(), 0);
  TestServer server;
  server.server().stop();
  server.server().stop();
}

}  // namespace
}  // namespace skylight::http
