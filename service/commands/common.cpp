#include <cstdio>

#include <unistd.h>

#include "service/commands/commands.hpp"

namespace skylight::service {

void ConfigFlags::add_to(CLI::App& command, bool with_file) {
  if (with_file)
    command.add_option("--config", file,
                       "Configuration file, JSON with comments (see deploy/skylight.sample.json)");
  command.add_option("--set", sets, "A configuration value, key.path=value; may be given more than once")
      ->allow_extra_args(false);
}

Config ConfigFlags::load(const std::vector<Override>& more) const {
  ConfigLayers layers{.environment = skylight_environment(), .flags = more};
  if (!file.empty()) layers.file = file;
  for (const std::string& assignment : sets)
    layers.flags.push_back({assignment, "--set " + assignment.substr(0, assignment.find('='))});
  return load_config(layers);
}

std::string camera_of_input(const std::string& config_file, const std::string& input) {
  namespace fs = std::filesystem;
  const settings::Document file = settings::load(config_file);
  const settings::Node* cameras = file.root.find("cameras");
  const std::string folder = fs::weakly_canonical(fs::absolute(input)).filename().string();
  std::optional<std::string> first;
  for (std::size_t i = 0; cameras != nullptr && i < cameras->children.size(); ++i) {
    const settings::Node* id = cameras->children[i].find("id");
    const std::string* name = id != nullptr ? std::get_if<std::string>(&id->scalar) : nullptr;
    if (name == nullptr) continue;
    if (*name == folder) return folder;
    if (!first) first = *name;
  }
  return first.value_or("camera");
}

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)), total_(total), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (terminal_ && done_ > 0) std::fputs("\r\033[K", stderr);
}

void Progress::step() {
  ++done_;
  const auto now = std::chrono::steady_clock::now();
  if (!terminal_ || now - shown_ < std::chrono::milliseconds(100)) return;
  shown_ = now;
  if (total_ > 0) {
    std::fprintf(stderr, "\r\033[K%s: %zu of %zu frames (%zu %%)", what_.c_str(), done_, total_,
                 100 * done_ / total_);
  } else {
    std::fprintf(stderr, "\r\033[K%s: %zu frames", what_.c_str(), done_);
  }
}

}  // namespace skylight::service
