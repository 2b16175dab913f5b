// skylight_report_sample <folder>: writes the sample into it, and the hostile one into <folder>/hostile.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "sample.hpp"
#include "service/report/report.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("skylight_report_sample <folder>\n", stderr);
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    skylight::service::report::write(skylight::service::report::sample_document(), folder);
    skylight::service::report::write(skylight::service::report::hostile_document(), folder / "hostile");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "skylight_report_sample: %s\n", error.what());
    return 1;
  }
  return 0;
}
