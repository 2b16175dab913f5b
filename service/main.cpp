// skylight: tells robots and people where robots are.
#include <cstdio>
#include <exception>
#include <optional>

#include "service/commands/commands.hpp"
#include "settings/document.hpp"

namespace {

using namespace skylight::service;

int report(const std::exception& error, int code) {
  std::fprintf(stderr, "skylight: %s\n", error.what());
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tells robots and people where robots are, from cameras in the ceiling.", "skylight");
  app.set_version_flag("--version", std::string("skylight ") + SKYLIGHT_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* at, const CLI::Error& error) {
    return std::string("skylight: ") + error.what() + "\nsee " + at->get_name() + " --help\n";
  });
  Run run;
  add_serve(app, run);
  add_track(app, run);
  add_simulate(app, run);
  add_evaluate(app, run);
  try {
    app.parse(argc, argv);
    return run();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const UsageError& error) {
    return report(error, 2);
  } catch (const skylight::settings::Error& error) {
    return report(error, 2);
  } catch (const std::exception& error) {
    return report(error, 1);
  }
}
