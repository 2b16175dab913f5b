// Files that come with the program: the page, the API description, the scenarios.
#pragma once

#include <filesystem>
#include <string>

namespace skylight::service {

/// `relative` ("web/index.html") where Skylight is installed, or else in the source folder it was built from.
/// Empty where it is in neither.
std::filesystem::path find_resource(const std::filesystem::path& relative);

/// A whole file. Throws std::runtime_error naming it.
std::string read_file(const std::filesystem::path& path);

}  // namespace skylight::service
