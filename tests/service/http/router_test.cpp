#include "service/http/router.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

namespace skylight::http {
namespace {

Handler nothing() {
  return [](const Request&) { return Reply{}; };
}

TEST(Router, FillsTheParametersOfThePatternFromThePath) {
  Router router;
  router.add("GET", "/api/v1/robots/{id}/pose", nothing());
  const Router::Match match = router.match("GET", {"api", "v1", "robots", "r 7", "pose"});
  ASSERT_NE(match.route, nullptr);
  EXPECT_EQ(match.route->pattern, "/api/v1/robots/{id}/pose");
  EXPECT_EQ(match.path_params, (std::map<std::string, std::string>{{"id", "r 7"}}));
}

TEST(Router, PrefersALiteralSegmentAndComesBackToTheParameterWhenItLeadsNowhere) {
  Router router;
  router.add("GET", "/robots/{id}", nothing());
  router.add("GET", "/robots/new", nothing());
  router.add("GET", "/robots/{id}/pose", nothing());
  EXPECT_EQ(router.match("GET", {"robots", "new"}).route->pattern, "/robots/new");
  EXPECT_EQ(router.match("GET", {"robots", "old"}).route->pattern, "/robots/{id}");
  EXPECT_EQ(router.match("GET", {"robots", "new", "pose"}).route->pattern, "/robots/{id}/pose");
}

TEST(Router, TellsAnUnknownPathFromAWrongMethod) {
  Router router;
  router.add("GET", "/robots", nothing());
  router.add("POST", "/robots", nothing());
  EXPECT_EQ(router.match("GET", {"robot"}).allow, "");
  const Router::Match wrong = router.match("DELETE", {"robots"});
  EXPECT_EQ(wrong.route, nullptr);
  EXPECT_EQ(wrong.allow, "GET, HEAD, POST, OPTIONS");
}

TEST(Router, AnswersHeadByTheRouteOfGet) {
  Router router;
  router.add("GET", "/robots", nothing());
  EXPECT_NE(router.match("HEAD", {"robots"}).route, nullptr);
}

TEST(Router, FillsNoParameterWithAnEmptySegmentNorWithTwo) {
  Router router;
  router.add("GET", "/robots/{id}", nothing());
  EXPECT_EQ(router.match("GET", {"robots", ""}).route, nullptr);
  EXPECT_EQ(router.match("GET", {"robots"}).route, nullptr);
  EXPECT_EQ(router.match("GET", {"robots", "a", "b"}).route, nullptr);
}

TEST(Router, KeepsEachMethodsOwnParameterNames) {
  Router router;
  router.add("GET", "/robots/{id}", nothing());
  router.add("DELETE", "/robots/{robot}", nothing());
  EXPECT_EQ(router.match("DELETE", {"robots", "a"}).path_params.count("robot"), 1U);
  EXPECT_EQ(router.match("GET", {"robots", "a"}).path_params.count("id"), 1U);
}

TEST(Router, ListsItsRoutesInTheirOrder) {
  Router router;
  router.add("GET", "/b", nothing());
  router.add("GET", "/a", nothing(), Lane::slow);
  const std::vector<Route> routes = router.routes();
  ASSERT_EQ(routes.size(), 2U);
  EXPECT_EQ(routes[0].pattern, "/b");
  EXPECT_EQ(routes[1].options.lane, Lane::slow);
}

TEST(Router, RefusesPatternsThatCannotBeMeant) {
  Router router;
  router.add("GET", "/robots/{id}", nothing());
  const auto refused = [&](const std::string& method, const std::string& pattern) {
    EXPECT_THROW(router.add(method, pattern, nothing()), std::invalid_argument) << method << ' ' << pattern;
  };
  refused("GET", "/robots/{other}");
  refused("get", "/x");
  refused("HEAD", "/x");
  refused("GET", "");
  refused("GET", "robots");
  refused("GET", "/robots/");
  refused("GET", "/robots//pose");
  refused("GET", "/robots/{}");
  refused("GET", "/robots/r{id}");
  refused("GET", "/robots/{id}{x}");
  refused("GET", "/pairs/{id}/{id}");
  EXPECT_THROW(router.add("GET", "/x", nullptr), std::invalid_argument);
  EXPECT_EQ(router.routes().size(), 1U);
}

}  // namespace
}  // namespace skylight::http
