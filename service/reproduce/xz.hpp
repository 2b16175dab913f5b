// Files packed by xz.
#pragma once

#include <filesystem>
#include <string>

namespace skylight::service::reproduce {

/// What is packed in the file. Throws std::runtime_error with the reason (not the name) where it cannot be
/// read, is no such file, is damaged or cut short, or holds more than 64 MiB.
std::string read_xz(const std::filesystem::path& path);

}  // namespace skylight::service::reproduce
