// The gate by itself, for what the parser in front of it refuses as well: neither relies on the other.
#include "service/http/gate.hpp"

#include <gtest/gtest.h>

namespace skylight::http {
namespace {

class GateAlone : public testing::Test {
 protected:
  GateAlone() {
    router_.add("PUT", "/robots/{id}", [](const Request&) { return Reply{}; });
  }
  /// 0 where it may pass, else the problem's status.
  int refusal(std::vector<std::pair<std::string_view, std::string_view>> headers, bool http10 = false) const {
    headers.emplace_back("Host", "192.0.2.7");
    headers.emplace_back("Content-Type", "application/json");
    try {
      gate_.admit({.method = "PUT",
                   .target = "/robots/a",
                   .http10 = http10,
                   .headers = std::move(headers),
                   .local_address = "192.0.2.7"});
      return 0;
    } catch (const Problem& problem) {
      return problem.answer().status;
    }
  }

  ServerOptions options_;
  Router router_;
  StaticFiles files_{{}};
  Gate gate_{options_, router_, files_};
};

TEST_F(GateAlone, LetsPassTheTwoFramingsThatCannotBeMistaken) {
  EXPECT_EQ(refusal({{"Content-Length", "5"}}), 0);
  EXPECT_EQ(refusal({{"Transfer-Encoding", "chunked"}}), 0);
}

TEST_F(GateAlone, RefusesEveryOtherFraming) {
  EXPECT_EQ(refusal({{"Content-Length", "5"}, {"Transfer-Encoding", "chunked"}}), 400);
  EXPECT_EQ(refusal({{"Content-Length", "5"}, {"content-length", "5"}}), 400);
  EXPECT_EQ(refusal({{"Transfer-Encoding", "chunked"}, {"Transfer-Encoding", "chunked"}}), 400);
  EXPECT_EQ(refusal({{"Transfer-Encoding", "chunked"}}, true), 400);
  for (const char* length : {"", "-5", "+5", "5x", "0x5", "5, 5", "99999999999999999999"}) {
    EXPECT_EQ(refusal({{"Content-Length", length}}), 400) << length;
  }
  for (const char* coding : {"", "gzip", "chunked, gzip", "gzip, chunked", "identity", "xchunked"}) {
    EXPECT_EQ(refusal({{"Transfer-Encoding", coding}}), 400) << coding;
  }
}

TEST_F(GateAlone, CountsABodyInChunksAsLongAsItMayBecome) {
  const Admission admission = gate_.admit(
      {.method = "PUT",
       .target = "/robots/a",
       .headers = {
           {"Host", "localhost"}, {"Content-Type", "application/json"}, {"Transfer-Encoding", "chunked"}}});
  EXPECT_EQ(admission.expected_bytes, options_.max_body_bytes);
}

}  // namespace
}  // namespace skylight::http
