#include "tests/service/http/test_server.hpp"

#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

namespace skylight::http::test {
namespace {

Reply echo(const Request& request) {
  nlohmann::json json{{"method", request.method},           {"path", request.path},
                      {"path_params", request.path_params}, {"headers", request.headers},
                      {"body_bytes", request.body.size()},  {"remote_address", request.remote_address}};
  for (const auto& [name, value] : request.query) json["query"][name].push_back(value);
  if (request.body.size() < 100) json["body"] = request.body;
  return {.body = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

Reply throw_as_told(const Request& request) {
  const std::string how = request.path_param("how");
  if (how == "problem") throw Problem(422, "Out of range", "at is 5, allowed are 0 to 3");
  if (how == "standard") throw std::runtime_error("the secret\r\nof the handler");
  if (how == "number") throw 42;  // NOLINT: what handlers must not do and may
  if (how == "status") return {.status = 99};
  return {.status = 404, .body = ""};
}

Reply own_headers(const Request& /*request*/) {
  return {.content_type = "text/csv",
          .body = "a,b\n",
          .headers = {{"Cache-Control", "max-age=5"},
                      {"ETag", "\"7\""},
                      {"Content-Length", "9999"},
                      {"X-Bad", "one\r\nX-Smuggled: two"},
                      {"X Bad", "name"}}};
}

}  // namespace

void Barrier::open() {
  const std::lock_guard lock(mutex_);
  open_ = true;
  changed_.notify_all();
}

void Barrier::pass() {
  std::unique_lock lock(mutex_);
  ++inside_;
  changed_.notify_all();
  changed_.wait(lock, [this] { return open_; });
}

void Barrier::wait_until_inside(int count) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return inside_ >= count; });
}

Router TestServer::routes() {
  Router router;
  const Handler held = [this](const Request& request) {
    barrier_.pass();
    return echo(request);
  };
  router.add("GET", "/api/echo/{id}", echo);
  router.add("DELETE", "/api/echo/{id}", echo);
  router.add("POST", "/api/echo", echo);
  router.add("PUT", "/api/echo", echo);
  router.add("POST", "/api/form", echo, {.content_types = {"application/x-www-form-urlencoded"}});
  router.add("PUT", "/api/picture", echo,
             {.lane = Lane::slow, .max_body_bytes = 4U * 1024 * 1024, .content_types = {"image/png"}});
  router.add("GET", "/api/big", [](const Request&) {
    return Reply{.content_type = "application/octet-stream", .body = std::string(8U * 1024 * 1024, 'b')};
  });
  router.add("GET", "/api/throw/{how}", throw_as_told);
  router.add("GET", "/api/wait", held);
  router.add("GET", "/api/slow", held, Lane::slow);
  router.add("GET", "/api/empty", [](const Request&) { return Reply{.status = 204}; });
  router.add("GET", "/api/own", own_headers);
  return router;
}

TestServer::TestServer(ServerOptions options) {
  options.port = 0;
  options.log = [this](const std::string& line) {
    const std::lock_guard lock(log_mutex_);
    log_ += line + '\n';
  };
  std::vector<StaticFile> files{
      {.path = "/", .content_type = "text/html; charset=utf-8", .body = "<!doctype html><title>room</title>"},
      {.path = "/text", .content_type = "text/plain", .body = std::string(60'000, 't')},
      {.path = "/app.js", .content_type = "text/javascript", .body = std::string(300'000, ';')}};
  server_ = std::make_unique<Server>(std::move(options), routes(), std::move(files));
  server_->start();
}

TestServer::~TestServer() {
  barrier_.open();
  server_->stop();
}

std::string TestServer::log() const {
  const std::lock_guard lock(log_mutex_);
  return log_;
}

}  // namespace skylight::http::test
