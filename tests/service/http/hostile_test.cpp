// Peers that hold on to connections: deadlines, the bound on connections, running out of descriptors.
#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/service/http/raw_client.hpp"
#include "tests/service/http/test_server.hpp"

namespace skylight::http {
namespace {

using std::chrono::milliseconds;
using test::get_request;
using test::RawClient;
using test::TestServer;

constexpr milliseconds kShort{150};
constexpr std::chrono::hours kLong{24};  // so that no other deadline can be the one that cuts
constexpr const char* kPutHead =
    "PUT /api/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: "
    "100\r\n\r\n";

// One byte now and then: always something, never all.
void dribble(RawClient& client, const std::string& bytes) {
  for (const char byte : bytes) {
    if (client.readable_within(20)) return;  // cut, or answered
    if (!client.send({&byte, 1})) return;
  }
}

TEST(Deadlines, CutAConnectionThatSaysNothing) {
  const TestServer server({.deadlines = {.idle = kShort}});
  RawClient silent(server.port());
  EXPECT_TRUE(silent.ends());
  RawClient after_one(server.port());
  EXPECT_TRUE(after_one.ask(get_request("/api/echo/1")));
  EXPECT_TRUE(after_one.ends());
}

TEST(Deadlines, CutAHeadThatDribblesHoweverSteadily) {
  const TestServer server({.deadlines = {.idle = kLong, .head = kShort}});
  RawClient client(server.port());
  client.send("GET / HTTP/1.1\r\nX: ");
  dribble(client, std::string(2000, 'a'));  // 40 s of dribbling at the least
  EXPECT_FALSE(client.read_answer());
  EXPECT_TRUE(client.ends());
}

TEST(Deadlines, CutABodyThatDribblesHoweverSteadily) {
  const TestServer server({.deadlines = {.idle = kLong, .head = kLong, .body = kShort}});
  RawClient client(server.port());
  client.send(
      "PUT /api/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: "
      "9999\r\n\r\n");
  dribble(client, std::string(2000, ' '));
  EXPECT_FALSE(client.read_answer());
  EXPECT_TRUE(client.ends());
}

TEST(Deadlines, CutAClientThatDoesNotTakeItsAnswers) {
  const TestServer server({.deadlines = {.write = kShort}});
  RawClient client(server.port());
  std::string many;
  for (int i = 0; i < 2000; ++i) many += get_request("/text");  // 120 MB of answers, more than sockets buffer
  client.send(many);
  EXPECT_TRUE(client.is_reset());
}

TEST(Deadlines, CutALingeringPeer) {
  const TestServer server({.deadlines = {.linger = kShort}});
  RawClient client(server.port());
  EXPECT_EQ(client.ask("nonsense\r\n\r\n")->status, 400);
  EXPECT_TRUE(client.ends());
}

TEST(HostileConnections, DoNotKeepANormalClientFromBeingServed) {
  const TestServer server;
  std::vector<RawClient> hostile;
  for (int i = 0; i < 200; ++i) {
    RawClient& client = hostile.emplace_back(server.port());
    if (i % 4 == 1) client.send("GET / HTTP/1.1\r\nX-Slow: ");
    if (i % 4 == 2) client.send(kPutHead);
    if (i % 4 == 3) client.send("\x16\x03\x01");
  }
  RawClient normal(server.port());
  for (int round = 0; round < 50; ++round) {
    for (std::size_t i = 1; i < hostile.size(); i += 2) hostile[i].send("a");
    const auto answer = normal.ask(get_request("/api/echo/" + std::to_string(round)));
    ASSERT_TRUE(answer) << round;
    ASSERT_EQ(answer->status, 200);
  }
  EXPECT_EQ(RawClient(server.port()).ask(get_request("/"))->status, 200);
}

TEST(HostileConnections, MakeRoomWhenAllConnectionsAreTaken) {
  TestServer server({.max_connections = 10});
  RawClient working(server.port());
  working.send(get_request("/api/wait"));
  server.barrier().wait_until_inside(1);
  std::vector<RawClient> idle;
  for (int i = 0; i < 30; ++i) idle.emplace_back(server.port()).send("GET /");
  EXPECT_EQ(RawClient(server.port()).ask(get_request("/api/echo/1"))->status, 200);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(idle[static_cast<std::size_t>(i)].ends()) << i;  // the oldest went
  server.barrier().open();
  EXPECT_EQ(working.read_answer()->status, 200);  // the one at work stayed
}

TEST(HostileConnections, AreToldThatAllAreTakenWhenAllAreAtWork) {
  TestServer server({.quick_threads = 3, .max_connections = 3});
  std::vector<RawClient> working;
  for (int i = 0; i < 3; ++i) working.emplace_back(server.port()).send(get_request("/api/wait"));
  server.barrier().wait_until_inside(3);
  RawClient more(server.port());
  const auto answer = more.read_answer();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 503);
  server.barrier().open();
  for (RawClient& client : working) EXPECT_EQ(client.read_answer()->status, 200);
}

TEST(Descriptors, AreRaisedToWhatTheConnectionsNeed) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit low = before;
  low.rlim_cur = std::min<rlim_t>(300, before.rlim_max);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  {
    const TestServer server({.max_connections = 600});
    rlimit now{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &now), 0);
    EXPECT_GE(now.rlim_cur, std::min<rlim_t>(600, before.rlim_max));
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
}

// clang's UBSan opens a pipe to look whether an object's vptr can be read, and takes "no descriptor left" for
// a bad object.
#if defined(__has_feature)
#if __has_feature(undefined_behavior_sanitizer)
#define SKYLIGHT_SANITIZER_NEEDS_DESCRIPTORS
#endif
#endif

TEST(Descriptors, MayRunOutAndComeBack) {
#ifdef SKYLIGHT_SANITIZER_NEEDS_DESCRIPTORS
  GTEST_SKIP() << "the undefined-behaviour sanitizer itself needs descriptors";
#endif
  const TestServer server;
  ASSERT_EQ(RawClient(server.port()).ask(get_request("/"))->status, 200);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit low = before;
  const int next = ::open("/dev/null", O_RDONLY);  // the lowest free one tells how many are in use
  ::close(next);
  low.rlim_cur = static_cast<rlim_t>(next) + 12;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  {
    std::vector<RawClient> clients;
    try {
      while (true) clients.emplace_back(server.port());  // each takes one here, and one at the server
    } catch (const std::runtime_error&) {                // none left
    }
    ASSERT_GE(clients.size(), 6U);
    clients.back().send(get_request("/"));
    EXPECT_FALSE(clients.back().readable_within(500) && clients.size() < 6);
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(RawClient(server.port()).ask(get_request("/"))->status, 200);
  EXPECT_NE(server.log().find("cannot take connections for now"), std::string::npos);
}

}  // namespace
}  // namespace skylight::http
