#include <csignal>
#include <iostream>

#include <pthread.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "service/calibration/guide.hpp"
#include "service/commands/commands.hpp"
#include "service/http/server.hpp"
#include "service/resources.hpp"
#include "service/routes/context.hpp"
#include "service/self_calibration.hpp"
#include "service/simulator_desk.hpp"

namespace skylight::service {
namespace {

struct ServeFlags {
  ConfigFlags config;
  std::string scenario;
  std::string host;
  std::optional<int> port;
  bool print_routes = false;
};

std::vector<Override> overrides(const ServeFlags& flags) {
  std::vector<Override> out;
  if (!flags.scenario.empty()) {
    out.push_back({"source.type=simulator", "--scenario"});
    out.push_back({"source.scenario=" + flags.scenario, "--scenario"});
  }
  if (!flags.host.empty()) out.push_back({"server.host=" + flags.host, "--host"});
  if (flags.port) out.push_back({"server.port=" + std::to_string(*flags.port), "--port"});
  return out;
}

std::shared_ptr<spdlog::logger> make_logger(LogLevel level) {
  auto logger = spdlog::stderr_color_mt("skylight");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %^%l%$ %v");
  logger->set_level(static_cast<spdlog::level::level_enum>(level));
  return logger;
}

spdlog::level::level_enum level_of(const Event& event) {
  switch (event.severity) {
    case Severity::info:
      return spdlog::level::info;
    case Severity::warning:
      return spdlog::level::warn;
    case Severity::error:
      break;
  }
  return spdlog::level::err;
}

std::vector<http::StaticFile> page_files() {
  struct Served {
    const char* path;
    const char* file;
    const char* type;
  };
  constexpr Served kFiles[] = {{"/", "web/index.html", "text/html; charset=utf-8"},
                               {"/page.js", "web/page.js", "text/javascript; charset=utf-8"},
                               {"/simulator.js", "web/simulator.js", "text/javascript; charset=utf-8"},
                               {"/page.css", "web/page.css", "text/css; charset=utf-8"},
                               {"/icon.svg", "web/icon.svg", "image/svg+xml"},
                               {"/openapi.json", "service/openapi.json", "application/json"}};
  std::vector<http::StaticFile> files;
  for (const Served& served : kFiles) {
    const auto path = find_resource(served.file);
    if (path.empty()) throw std::runtime_error(std::string(served.file) + ": missing from the installation");
    files.push_back({.path = served.path, .content_type = served.type, .body = read_file(path)});
  }
  return files;
}

http::ServerOptions server_options(const ServerConfig& config, std::function<void(const std::string&)> log) {
  return {.host = config.host,
          .port = config.port,
          .quick_threads = config.threads,
          .max_body_bytes = config.max_body_bytes,
          .allowed_hosts = config.allowed_hosts,
          .allowed_origins = config.allowed_origins,
          .log = std::move(log)};
}

// Every thread inherits the mask, so that the signals wait for sigwait alone.
sigset_t block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

int print_routes(const http::Router& router) {
  for (const http::Route& route : router.routes()) std::cout << route.method << " " << route.pattern << "\n";
  return 0;
}

int serve(const ServeFlags& flags) {
  const Config config = flags.config.load(overrides(flags));
  const auto logger = make_logger(config.log.level);
  const auto warn = [logger](const std::string& line) { logger->warn("{}", line); };
  const sigset_t signals = block_signals();

  Assembly assembly = assemble(config);
  AppearanceStore appearances(assembly.appearances);
  const std::size_t robots = assembly.robots.size();
  const WatchConfig& watch = config.camera_watch;
  const auto events = std::make_shared<EventLog>();
  events->listen([logger](const Event& event) { logger->log(level_of(event), "{}", to_line(event)); });
  Pipeline pipeline(
      pipeline_parts(assembly),
      {.log = warn, .events = events, .watch = watch.enabled ? std::optional(watch.settings) : std::nullopt});
  SimulatorDesk simulator(config, assembly.live, pipeline, appearances);
  const PostedCameras posted = assembly.posted;
  assembly = {};  // what runs belongs to the pipeline: another scenario takes its place
  CalibrationDesk calibration(pipeline);
  IntrinsicsGuide guide(pipeline, calibration);
  const RouteContext context{.pipeline = pipeline,
                             .appearances = appearances,
                             .default_method = config.tracker.method,
                             .horizon = from_seconds(config.prediction.horizon_s),
                             .simulator = &simulator,
                             .posted = posted,
                             .calibration = &calibration,
                             .guide = &guide,
                             .floor = config.floor};
  http::Router router;
  add_health_routes(router, context);
  add_robot_routes(router, context);
  add_pose_routes(router, context);
  add_appearance_routes(router, context);
  add_camera_routes(router, context);
  add_calibration_routes(router, context);
  add_intrinsics_routes(router, context);
  add_extrinsics_routes(router, context);
  add_floor_routes(router, context);
  add_frame_routes(router, context);
  add_event_routes(router, context);
  add_odometry_routes(router, context);
  add_geometry_routes(router, context);
  add_simulator_routes(router, context);
  if (flags.print_routes) return print_routes(router);
  http::Server server(server_options(config.server, warn), std::move(router), page_files());
  server.start();
  pipeline.start();
  std::optional<SelfCalibration> self_calibration;
  if (config.camera_watch.recalibrate) self_calibration.emplace(pipeline, calibration);
  std::cout << "Skylight at http://" << config.server.host << ":" << server.port() << "/\n" << std::flush;
  logger->info("{} cameras, {} robots", context.pipeline.snapshot()->cameras.size(), robots);

  int signal = 0;
  sigwait(&signals, &signal);
  logger->info("stopping");
  server.stop();
  self_calibration.reset();
  pipeline.stop();
  return 0;
}

}  // namespace

void add_serve(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ServeFlags>();
  CLI::App* command = app.add_subcommand("serve", "The service: tracks, and answers over HTTP");
  flags->config.add_to(*command);
  command->add_option("--scenario", flags->scenario, "Simulate this scenario: a name, or a .json file");
  command->add_option("--host", flags->host, "Address to listen on (127.0.0.1)");
  command->add_option("--port", flags->port, "Port to listen on (8080; 0: any)");
  command->add_flag("--print-routes", flags->print_routes, "Print the API's routes and leave");
  command->callback([flags, &run] { run = [flags] { return serve(*flags); }; });
}

}  // namespace skylight::service
