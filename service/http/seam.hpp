// The seam to cpp-httplib: whole, checked API requests go in, the bytes of their answers come out. Only
// seam.cpp knows the library, so that it can be exchanged in one commit.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "service/http/router.hpp"
#include "service/http/target.hpp"
#include "service/http/wire.hpp"

namespace skylight::http {

using Log = std::function<void(const std::string&)>;

/// A request that the front has checked and read to its end.
struct ApiRequest {
  std::string method;
  Target target;
  HeaderList headers;  ///< of kPassedHeaders, lower-case names
  std::string body;
  const Route* route = nullptr;
  std::map<std::string, std::string> path_params;
  std::string remote_address;
  Envelope envelope;
};

/// One for each worker thread: it holds the request that it is answering.
class Seam {
 public:
  explicit Seam(Log log);
  ~Seam();
  Seam(const Seam&) = delete;
  Seam& operator=(const Seam&) = delete;

  /// Runs the handler. Always gives a whole answer: what a handler throws becomes a problem.
  std::string answer(const ApiRequest& request) noexcept;

 private:
  class Library;
  std::unique_ptr<Library> library_;
};

}  // namespace skylight::http
