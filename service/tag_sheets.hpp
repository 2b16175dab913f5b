// Sheets of AprilTags, drawn by cairo as vectors: as exact as the printer is.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace skylight::service {

struct Paper {
  std::string_view name = "A4";
  double width_mm = 210.0;
  double height_mm = 297.0;
};

struct TagSheets {
  std::string family = "36h11";  ///< one of tag_families()
  std::vector<int> ids;          ///< at least one; 0 and up, as many as the family has
  double size_m = 0.1;  ///< as TagSpec::size_m; what fits the paper with rim and margins, at least 0.005
  Paper paper;
  std::string out;  ///< its ending tells the format: .pdf, or .svg for what fits one sheet
};

/// "0-11", "3,5,7-9": in this order, each number once. Throws std::invalid_argument naming what is wrong.
std::vector<int> parse_ids(std::string_view text);

/// "A4", "Letter". Throws std::invalid_argument naming both.
Paper parse_paper(std::string_view name);

/// Where tags go on a sheet: rows of squares, as many as fit.
struct SheetLayout {
  double cell_mm = 0.0;   ///< of the tag's pattern
  double whole_mm = 0.0;  ///< edge of all that is printed of a tag, white rim included
  int columns = 0;
  int rows = 0;
  int per_sheet() const { return columns * rows; }
};

/// Throws std::invalid_argument for a family or size that there is not, or that does not fit the paper,
/// naming the largest size that does.
SheetLayout layout(const TagSheets& sheets);

/// Upper left corner of the i-th tag of a sheet (its white rim's), millimetres from the sheet's own.
std::array<double, 2> place_of(const TagSheets& sheets, const SheetLayout& layout, int i);

/// Writes the file; returns the number of sheets. Each tag stands between cutting marks (they cut off nothing
/// of its white rim), with family, id and size under it; each sheet has a bar of 100 mm to check the printer.
/// Throws std::invalid_argument as layout() and for ids that the family does not have, std::runtime_error
/// where the file cannot be written.
int write_tag_sheets(const TagSheets& sheets);

}  // namespace skylight::service
