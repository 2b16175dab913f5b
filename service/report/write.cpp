#include <cerrno>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "service/report/report.hpp"

namespace skylight::service::report {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(int error, const fs::path& file) {
  throw std::system_error(error, std::generic_category(), "cannot write " + file.string());
}

// Closed, and removed unless it was renamed to where it belongs.
class Draft {
 public:
  explicit Draft(const fs::path& file) : file_(file), draft_(file) {
    draft_ += "." + std::to_string(::getpid()) + ".part";
    descriptor_ = ::open(draft_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) fail(errno, file_);
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  ~Draft() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!kept_) ::unlink(draft_.c_str());
  }

  void write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(descriptor_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(errno, file_);
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  }

  void keep() {
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (closed != 0 || ::rename(draft_.c_str(), file_.c_str()) != 0) fail(errno, file_);
    kept_ = true;
  }

 private:
  fs::path file_, draft_;
  int descriptor_ = -1;
  bool kept_ = false;
};

void write_file(const fs::path& file, std::string_view text) {
  Draft draft(file);
  draft.write(text);
  draft.keep();
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(error.value(), folder);
}

void write_plot(const Plot& plot, const fs::path& folder) {
  write_file(folder / "plots" / (plot.id + ".csv"), csv(plot));
  write_file(folder / "plots" / (plot.id + ".svg"), svg(plot));
}

void write_block(const Block& block, const fs::path& folder) {
  if (const auto* table = std::get_if<Table>(&block)) {
    write_file(folder / "tables" / (table->id + ".csv"), csv(*table));
  } else if (const auto* plot = std::get_if<Plot>(&block)) {
    write_plot(*plot, folder);
  } else if (const auto* gallery = std::get_if<Gallery>(&block)) {
    for (const Plot& one : gallery->plots) write_plot(one, folder);
  }
}

}  // namespace

void write(const Document& document, const fs::path& folder) {
  check(document);
  make_folder(folder / "tables");
  make_folder(folder / "plots");
  for (const Section& section : document.sections) {
    for (const Block& block : section.blocks) write_block(block, folder);
  }
  write_file(folder / "report.json", to_json(document).dump() + "\n");
  write_file(folder / "report.html", html(document));
}

}  // namespace skylight::service::report
