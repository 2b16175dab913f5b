#include "sim/render/tags.hpp"

#include <array>
#include <memory>
#include <stdexcept>

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <opencv2/imgproc.hpp>

namespace skylight::sim {
namespace {

struct Family {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr std::array kFamilies{
    Family{"36h11", tag36h11_create, tag36h11_destroy},
    Family{"25h9", tag25h9_create, tag25h9_destroy},
    Family{"16h5", tag16h5_create, tag16h5_destroy},
    Family{"Standard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
};

/// As the library lays its tags out: a ring of white around the black border (in the families with a white
/// border that ring is the border), and the code's bits, the first in the highest place.
cv::Mat draw_cells(const apriltag_family_t& family, int id) {
  cv::Mat cells(family.total_width, family.total_width, CV_8UC1, cv::Scalar(0));
  const int ring = family.width_at_border + (family.reversed_border ? 0 : 2);
  const int begin = (family.total_width - ring) / 2;
  cv::rectangle(cells, cv::Rect(begin, begin, ring, ring), cv::Scalar(255), 1);
  const int border = (family.total_width - family.width_at_border) / 2;
  const std::uint64_t code = family.codes[id];
  for (std::uint32_t i = 0; i < family.nbits; ++i) {
    if ((code >> (family.nbits - 1 - i) & 1U) == 0) continue;
    // Bits outside the border have places below 0, which the library keeps in unsigned numbers.
    const int x = static_cast<int>(family.bit_x[i]) + border;
    const int y = static_cast<int>(family.bit_y[i]) + border;
    cells.at<std::uint8_t>(y, x) = 255;
  }
  return cells;
}

const Family& family_of(const TagSpec& tag, const std::string& key) {
  for (const Family& family : kFamilies) {
    if (tag.family == family.name) return family;
  }
  throw std::invalid_argument(key + ".family: \"" + tag.family +
                              "\" is none of 36h11, 25h9, 16h5, Standard41h12");
}

}  // namespace

TagPattern tag_pattern(const TagSpec& tag, const std::string& key) {
  const Family& family = family_of(tag, key);
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> codes(family.create(),
                                                                               family.destroy);
  const int count = static_cast<int>(codes->ncodes);
  if (tag.id < 0 || tag.id >= count) {
    throw std::invalid_argument(key + ".id: " + std::to_string(tag.id) + " is not in the family " +
                                tag.family + " (0 to " + std::to_string(count - 1) + ")");
  }
  return {draw_cells(*codes, tag.id), codes->width_at_border};
}

}  // namespace skylight::sim
