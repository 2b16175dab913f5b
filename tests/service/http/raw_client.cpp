#include "tests/service/http/raw_client.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "service/http/text.hpp"

namespace skylight::http::test {
namespace {

constexpr int kWaitMs = 30'000;

bool wait_for(int socket, short events, int milliseconds) {
  pollfd entry{.fd = socket, .events = events, .revents = 0};
  return poll(&entry, 1, milliseconds) > 0;
}

void parse_head(std::string_view head, Answer& answer) {
  answer.status = std::stoi(std::string(head.substr(head.find(' ') + 1, 3)));
  while (true) {
    const std::size_t end = head.find("\r\n");
    if (end == std::string_view::npos) return;
    head.remove_prefix(end + 2);
    const std::string_view line = head.substr(0, head.find("\r\n"));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) continue;
    answer.headers.emplace(lower_case(line.substr(0, colon)), std::string(trim(line.substr(colon + 1))));
  }
}

}  // namespace

std::string Answer::header(const std::string& lower_case_name) const {
  const auto found = headers.find(lower_case_name);
  return found == headers.end() ? std::string() : found->second;
}

RawClient::RawClient(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  sockaddr generic{};
  std::memcpy(&generic, &address, sizeof(generic));
  if (socket_ >= 0 && ::connect(socket_, &generic, sizeof(address)) == 0) return;
  const std::string why = std::strerror(errno);
  if (socket_ >= 0) ::close(socket_);
  throw std::runtime_error("cannot connect: " + why);
}

RawClient::~RawClient() {
  if (socket_ >= 0) ::close(socket_);
}

RawClient::RawClient(RawClient&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), unread_(std::move(other.unread_)), ended_(other.ended_) {}

bool RawClient::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    } else if (errno != EAGAIN || !wait_for(socket_, POLLOUT, kWaitMs)) {
      return false;
    }
  }
  return true;
}

void RawClient::finish_sending() {
  ::shutdown(socket_, SHUT_WR);
}

bool RawClient::read_more() {
  if (ended_ || !wait_for(socket_, POLLIN, kWaitMs)) return false;
  std::array<char, 65536> chunk{};
  const ssize_t count = ::recv(socket_, chunk.data(), chunk.size(), 0);
  ended_ = count <= 0;
  if (!ended_) unread_.append(chunk.data(), static_cast<std::size_t>(count));
  return !ended_;
}

std::optional<Answer> RawClient::read_answer(bool head_only) {
  std::size_t head_end = 0;
  while ((head_end = unread_.find("\r\n\r\n")) == std::string::npos) {
    if (!read_more()) return std::nullopt;
  }
  Answer answer;
  parse_head(std::string_view(unread_).substr(0, head_end), answer);
  unread_.erase(0, head_end + 4);
  const std::string length = answer.header("content-length");
  const std::size_t bytes = head_only || length.empty() ? 0 : std::stoull(length);
  while (unread_.size() < bytes) {
    if (!read_more()) return std::nullopt;
  }
  answer.body = unread_.substr(0, bytes);
  unread_.erase(0, bytes);
  return answer;
}

std::optional<Answer> RawClient::ask(std::string_view bytes, bool head_only) {
  send(bytes);  // a peer that stops reading may still have answered
  return read_answer(head_only);
}

bool RawClient::ends() {
  while (read_more()) {
  }
  return ended_;
}

bool RawClient::readable_within(int milliseconds) {
  return !unread_.empty() || wait_for(socket_, POLLIN, milliseconds);
}

bool RawClient::is_reset() {
  return wait_for(socket_, 0, kWaitMs);
}

std::string get_request(const std::string& path, const std::string& more) {
  return "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + more + "\r\n";
}

std::string write_request(const std::string& method, const std::string& path, const std::string& body,
                          const std::string& more) {
  return method + ' ' + path + " HTTP/1.1\r\nHost: localhost\r\n" + more +
         "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

}  // namespace skylight::http::test
