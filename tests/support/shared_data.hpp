// The real pictures and trajectories that some tests judge against; they live beside the repository.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace skylight::test {

/// A file or folder in the shared data: $SKYLIGHT_SHARED_DATA, else ../shared/data beside the source
/// folder. None where it is absent: the test then skips, saying so (GTEST_SKIP).
inline std::optional<std::filesystem::path> shared_data(const std::string& name) {
  const char* from_env = std::getenv("SKYLIGHT_SHARED_DATA");
  const std::filesystem::path root =
      from_env != nullptr ? std::filesystem::path(from_env)
                          : std::filesystem::path(SKYLIGHT_SOURCE_DIR).parent_path() / "shared" / "data";
  std::error_code ignored;
  if (!std::filesystem::exists(root / name, ignored)) return std::nullopt;
  return root / name;
}

}  // namespace skylight::test
