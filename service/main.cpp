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
  const std::string version = std::string("skylight ") + SKYLIGHT_VERSION;
  app.set_version_flag("--version", version);
  app.require_subcommand(0, 1);  // that there is one is checked below: an unknown one is to be named
  app.failure_message([](const CLI::App* at, const CLI::Error& error) {
    return std::string("skylight: ") + error.what() + "\nsee " + at->get_name() + " --help\n";
  });
  Run run;
  add_serve(app, run);
  add_track(app, run);
  add_simulate(app, run);
  add_evaluate(app, run);
  add_reproduce(app, run);
  add_calibrate(app, run);
  add_tags(app, run);
  for (CLI::App* command : app.get_subcommands({})) command->set_version_flag("--version", version);
  try {
    app.parse(argc, argv);
    if (!run) throw UsageError("a command is needed; see skylight --help for what there is");
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
