#include "service/resources.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace skylight::service {

namespace fs = std::filesystem;

fs::path find_resource(const fs::path& relative) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& root : {program / SKYLIGHT_INSTALLED_RESOURCES, fs::path(SKYLIGHT_SOURCE_RESOURCES)}) {
    if (fs::exists(root / relative, error)) return fs::weakly_canonical(root / relative, error);
  }
  return {};
}

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) throw std::runtime_error(path.string() + ": cannot be read");
  return text.str();
}

}  // namespace skylight::service
