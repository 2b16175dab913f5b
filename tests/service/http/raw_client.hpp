// A client of bytes: sends what it is told, right or wrong, and reads answers by their own framing.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace skylight::http::test {

struct Answer {
  int status = 0;
  std::multimap<std::string, std::string> headers;  ///< lower-case names
  std::string body;

  /// Empty where it is absent.
  std::string header(const std::string& lower_case_name) const;
};

/// Every wait ends after 30 s with a failure, so that a test cannot hang; none depends on being quick.
class RawClient {
 public:
  /// Throws std::runtime_error where there is no connection to be had.
  explicit RawClient(std::uint16_t port);
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  RawClient(RawClient&& other) noexcept;
  RawClient& operator=(RawClient&&) = delete;

  /// False where the peer has closed before it took all.
  bool send(std::string_view bytes);
  void finish_sending();
  /// One answer; none where the connection ends (or 30 s pass) before a whole one has come.
  /// `head_only`: an answer to HEAD, without the body that its length promises.
  std::optional<Answer> read_answer(bool head_only = false);
  /// Sends and reads one.
  std::optional<Answer> ask(std::string_view bytes, bool head_only = false);
  /// Reads on to the end: true where the peer closes (or resets), false where 30 s pass.
  bool ends();
  /// True where something (or the end) can be read within that time.
  bool readable_within(int milliseconds);
  /// Reads nothing; true where the peer resets the connection, false where 30 s pass.
  bool is_reset();

 private:
  bool read_more();

  int socket_ = -1;
  std::string unread_;
  bool ended_ = false;
};

/// "GET <path>" with the Host of a loopback client; `more`: further header lines, each with its CRLF.
std::string get_request(const std::string& path, const std::string& more = "");
std::string write_request(const std::string& method, const std::string& path, const std::string& body,
                          const std::string& more = "Content-Type: application/json\r\n");

}  // namespace skylight::http::test
