// skylight tags: sheets of AprilTags to print.
#include "service/commands/commands.hpp"
#include "service/tag_sheets.hpp"

namespace skylight::service {
namespace {

struct TagsFlags {
  std::string ids;
  std::string paper = "A4";
  TagSheets sheets;
};

int print_tags(TagsFlags flags) {
  try {
    flags.sheets.ids = parse_ids(flags.ids);
    flags.sheets.paper = parse_paper(flags.paper);
    const int pages = write_tag_sheets(flags.sheets);
    std::printf("%s: %zu tags of %g m on %d %s of %s; print at 100 %%, and check the bar of 100 mm\n",
                flags.sheets.out.c_str(), flags.sheets.ids.size(), flags.sheets.size_m, pages,
                pages == 1 ? "sheet" : "sheets", flags.paper.c_str());
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  return 0;
}

}  // namespace

void add_tags(CLI::App& app, Run& run) {
  auto flags = std::make_shared<TagsFlags>();
  CLI::App* command = app.add_subcommand("tags", "Sheets of AprilTags to print, with cutting marks");
  command->add_option("--family", flags->sheets.family, "36h11, 25h9, 16h5, Standard41h12 (36h11)");
  command->add_option("--ids", flags->ids, "Numbers and ranges: 0-11 or 3,5,7-9")->required();
  command->add_option(
      "--size", flags->sheets.size_m,
      "Outer edge of the black border (Standard41h12: of the white ring inside), metres (0.1)");
  command->add_option("--paper", flags->paper, "A4, Letter (A4)");
  command->add_option("--out", flags->sheets.out, "File to write: .pdf; or .svg for a single sheet")
      ->required();
  command->callback([flags, &run] { run = [flags] { return print_tags(*flags); }; });
}

}  // namespace skylight::service
