// What the calibrate commands share.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "service/calibration/file.hpp"
#include "service/calibration/sheets.hpp"
#include "service/commands/commands.hpp"

namespace skylight::service {

void add_calibrate_intrinsics(CLI::App& calibrate, Run& run);
void add_calibrate_extrinsics(CLI::App& calibrate, Run& run);
void add_calibrate_robot(CLI::App& calibrate, Run& run);
void add_calibrate_map(CLI::App& calibrate, Run& run);
void add_calibrate_restore(CLI::App& calibrate, Run& run);

/// Numbers between commas, as many as wanted. Throws UsageError naming the option and what it wants.
std::vector<double> numbers_of(const std::string& text, std::size_t count, const std::string& option,
                               const std::string& form);

/// The id of a tag of the option --tag that reads `text`. Throws UsageError where it is no whole number from
/// 0 to 100000.
int tag_id(double id, const std::string& text);

/// A table of comma or semicolon separated values under a heading. Errors are std::runtime_error naming file,
/// line and column.
class CsvFile {
 public:
  explicit CsvFile(const std::filesystem::path& file);
  std::optional<std::size_t> find_column(const std::string& name) const;
  std::size_t column(const std::string& name) const;
  std::size_t rows() const { return rows_.size(); }
  int line(std::size_t row) const { return rows_[row].line; }
  /// Empty where the row ends before.
  const std::string& text(std::size_t row, std::size_t column) const;
  double number(std::size_t row, std::size_t column) const;

 private:
  struct Row {
    int line = 0;
    std::vector<std::string> cells;
  };
  std::string name_;
  std::vector<std::string> heading_;
  std::vector<Row> rows_;
};

/// Writes the file, keeping what was there, and says so on standard error.
void save(const std::filesystem::path& file, const CalibrationFile& calibration);

/// read_calibration() of a file that must have intrinsics of this picture's size, if one is given.
void check_size(const CalibrationFile& calibration, const std::string& file, const cv::Mat& picture,
                const std::string& picture_name);

/// Sheets from a JSON file (--tags).
std::vector<FloorSheet> read_sheets(const std::filesystem::path& file);

/// Clicked points: a CSV file with a heading, columns u_px, v_px, x_m, y_m and, if wanted, z_m and name.
/// Throws std::runtime_error naming file and line.
std::vector<calibration::SeenPoint> read_points(const std::filesystem::path& file);

}  // namespace skylight::service
