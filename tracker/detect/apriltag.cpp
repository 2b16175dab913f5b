#include "tracker/detect/apriltag.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <tuple>

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <opencv2/imgproc.hpp>

#include "tracker/detect/apriltag_fit.hpp"

namespace skylight {
namespace {

constexpr double kReadableEdge = 24.0;  // px: smaller tags are magnified to it before libapriltag looks
constexpr int kMostMagnified = 3;
constexpr int kLeastSide = 8;  // px: libapriltag works in tiles of 4

struct Family {
  std::string_view name;
  int count;
  int hamming;       ///< corrected bits unless the finder is told otherwise
  int most_hamming;  ///< more would read tags into bare floors, or take a table of 90 MB (Standard41h12)
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr std::array kFamilies{
    Family{"36h11", 587, 1, 2, tag36h11_create, tag36h11_destroy},
    Family{"25h9", 35, 1, 2, tag25h9_create, tag25h9_destroy},
    Family{"16h5", 30, 0, 0, tag16h5_create, tag16h5_destroy},
    Family{"Standard41h12", 2115, 1, 1, tagStandard41h12_create, tagStandard41h12_destroy},
};

const Family* find_family(std::string_view name) {
  const auto at = std::find_if(kFamilies.begin(), kFamilies.end(),
                               [&](const Family& family) { return family.name == name; });
  return at == kFamilies.end() ? nullptr : &*at;
}

std::string no_such_family(std::string_view name) {
  std::string text("family is '");
  text.append(name).append("', allowed:");
  for (const Family& family : kFamilies) text.append(" ").append(family.name);
  return text;
}

using FamilyPointer = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

FamilyPointer create(const Family& family) {
  return {family.create(), family.destroy};
}

/// As the library lays its tags out: a ring of white around the black border (in the families with a white
/// border that ring is the border), and the code's bits, the first in the highest place.
TagPattern draw(const apriltag_family_t& family, int id) {
  TagPattern pattern{cv::Mat(family.total_width, family.total_width, CV_8UC1, cv::Scalar(0)),
                     family.width_at_border};
  const int ring = family.width_at_border + (family.reversed_border ? 0 : 2);
  const int begin = (family.total_width - ring) / 2;
  cv::rectangle(pattern.cells, cv::Rect(begin, begin, ring, ring), cv::Scalar(255), 1);
  const int border = (family.total_width - family.width_at_border) / 2;
  for (std::uint32_t i = 0; i < family.nbits; ++i) {
    if ((family.codes[id] >> (family.nbits - 1 - i) & 1U) == 0) continue;
    // Bits outside the border have places below 0, which the library keeps in unsigned numbers.
    const int x = static_cast<int>(family.bit_x[i]) + border;
    const int y = static_cast<int>(family.bit_y[i]) + border;
    pattern.cells.at<std::uint8_t>(y, x) = 255;
  }
  return pattern;
}

/// libapriltag's detector with families of its own; one call at a time.
class Detector {
 public:
  Detector(const std::vector<const Family*>& families, const TagFinderConfig& config)
      : detector_(apriltag_detector_create(), apriltag_detector_destroy) {
    detector_->nthreads = 1;
    detector_->quad_decimate = 1.0F;  // what is small is magnified instead
    detector_->refine_edges = false;  // the fit does that, and better
    for (const Family* family : families) {
      families_.push_back(create(*family));
      apriltag_detector_add_family_bits(
          detector_.get(), families_.back().get(),
          std::min(config.max_hamming.value_or(family->hamming), family->most_hamming));
    }
  }

  /// Appends what it sees; quad_px by the library's pixels.
  void read(const cv::Mat& grey, const std::vector<const Family*>& families, std::vector<FoundTag>& found) {
    image_u8_t image{grey.cols, grey.rows, static_cast<std::int32_t>(grey.step), grey.data};
    const std::unique_ptr<zarray_t, void (*)(zarray_t*)> seen(
        apriltag_detector_detect(detector_.get(), &image), apriltag_detections_destroy);
    for (int i = 0; i < zarray_size(seen.get()); ++i) {
      apriltag_detection_t* one = nullptr;
      zarray_get(seen.get(), i, &one);
      FoundTag tag{.family = {}, .id = one->id, .hamming = one->hamming};
      for (std::size_t k = 0; k < families_.size(); ++k) {
        if (families_[k].get() == one->family) tag.family = families[k]->name;
      }
      // The library's corners begin at the bottom left and go around the other way.
      for (std::size_t k = 0; k < 4; ++k) tag.quad_px[3 - k] = Pixel(one->p[k][0], one->p[k][1]);
      found.push_back(tag);
    }
  }

 private:
  // In this order: the detector refers to the families until it is gone.
  std::vector<FamilyPointer> families_;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector_;
};

/// The part of the picture as grey levels.
cv::Mat grey_part(const cv::Mat& image, const cv::Rect& part) {
  if (image.channels() == 1) return image(part);
  cv::Mat grey;
  cv::cvtColor(image(part), grey, cv::COLOR_BGR2GRAY);
  return grey;
}

int magnification(double edge_px) {
  return std::clamp(static_cast<int>(std::ceil(kReadableEdge / edge_px)), 1, kMostMagnified);
}

Pixel middle_of(const TagCorners& corners) {
  return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
}

bool before(const FoundTag& a, const FoundTag& b) {
  const Pixel p = middle_of(a.corners_px);
  const Pixel q = middle_of(b.corners_px);
  return std::tuple(a.family, a.id, p.y(), p.x()) < std::tuple(b.family, b.id, q.y(), q.x());
}

}  // namespace

std::string check(const TagSpec& tag) {
  const Family* family = find_family(tag.family);
  if (family == nullptr) return no_such_family(tag.family);
  if (tag.id < 0 || tag.id >= family->count) {
    return "id is " + std::to_string(tag.id) + ", allowed 0 to " + std::to_string(family->count - 1) +
           " in the family " + tag.family;
  }
  const auto range = [](const char* field, double value, double low, double high) {
    if (value >= low && value <= high) return std::string();
    return std::string(field) + " is " + std::to_string(value) + ", allowed " + std::to_string(low) + " to " +
           std::to_string(high);
  };
  for (const std::string& wrong :
       {range("size_m", tag.size_m, 0.005, 5.0), range("height_m", tag.height_m, -1.0, 5.0),
        range("mounting.x", tag.mounting.x, -5.0, 5.0), range("mounting.y", tag.mounting.y, -5.0, 5.0),
        range("mounting.yaw", tag.mounting.yaw, -6.3, 6.3)}) {
    if (!wrong.empty()) return wrong;
  }
  return {};
}

const std::vector<std::string_view>& tag_families() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all;
    for (const Family& family : kFamilies) all.push_back(family.name);
    return all;
  }();
  return names;
}

int tag_count(std::string_view family) {
  const Family* known = find_family(family);
  return known == nullptr ? 0 : known->count;
}

int default_hamming(std::string_view family) {
  const Family* known = find_family(family);
  return known == nullptr ? 0 : known->hamming;
}

TagPattern tag_pattern(std::string_view family, int id) {
  if (const std::string wrong = check(TagSpec{.family = std::string(family), .id = id}); !wrong.empty())
    throw std::invalid_argument(wrong);
  return draw(*create(*find_family(family)), id);
}

// Detectors that nobody uses at the moment. Lock-free: a slot is emptied or filled by one exchange.
class IdleDetectors {
 public:
  IdleDetectors() = default;
  IdleDetectors(const IdleDetectors&) = delete;
  IdleDetectors& operator=(const IdleDetectors&) = delete;
  ~IdleDetectors() {
    for (auto& slot : slots_) delete slot.exchange(nullptr);
  }
  /// Null where there is none.
  std::unique_ptr<Detector> take() {
    for (auto& slot : slots_) {
      if (std::unique_ptr<Detector> detector(slot.exchange(nullptr)); detector) return detector;
    }
    return nullptr;
  }
  void give_back(std::unique_ptr<Detector> detector) {
    for (auto& slot : slots_) {
      Detector* none = nullptr;
      if (!slot.compare_exchange_strong(none, detector.get())) continue;
      detector.release();  // NOLINT(bugprone-unused-return-value): the slot owns it now
      return;
    }  // more threads than slots: this one goes
  }

 private:
  std::array<std::atomic<Detector*>, 32> slots_{};
};

struct TagFinder::Impl {
  std::vector<const Family*> families;
  TagFinderConfig config;
  std::map<std::string_view, FamilyPointer> codes;  ///< to draw patterns from; never changed
  IdleDetectors idle;
};

TagFinder::TagFinder(const std::vector<std::string>& families, const TagFinderConfig& config)
    : impl_(std::make_unique<Impl>()) {
  if (families.empty()) throw std::invalid_argument("a tag finder needs a family");
  if (config.max_hamming && (*config.max_hamming < 0 || *config.max_hamming > 2)) {
    throw std::invalid_argument("max_hamming is " + std::to_string(*config.max_hamming) + ", allowed 0 to 2");
  }
  if (!(config.min_score >= 0.0 && config.min_score <= 1.0))
    throw std::invalid_argument("min_score is " + std::to_string(config.min_score) + ", allowed 0 to 1");
  impl_->config = config;
  for (const std::string& name : families) {
    const Family* family = find_family(name);
    if (family == nullptr) throw std::invalid_argument(no_such_family(name));
    if (impl_->codes.contains(family->name)) continue;
    impl_->families.push_back(family);
    impl_->codes.emplace(family->name, create(*family));
  }
}

TagFinder::~TagFinder() = default;
TagFinder::TagFinder(TagFinder&&) noexcept = default;
TagFinder& TagFinder::operator=(TagFinder&&) noexcept = default;

std::vector<FoundTag> TagFinder::find(const cv::Mat& image, const TagLook& look) const {
  const cv::Rect part = look.part & cv::Rect({}, image.size());
  std::vector<FoundTag> found;
  if (part.width < kLeastSide || part.height < kLeastSide || !(look.edge_px > 0.0)) return found;
  const cv::Mat grey = grey_part(image, part);
  const int times = magnification(look.edge_px);
  cv::Mat magnified = grey;
  if (times > 1) cv::resize(grey, magnified, {}, times, times, cv::INTER_CUBIC);

  auto detector = impl_->idle.take();
  if (!detector) detector = std::make_unique<Detector>(impl_->families, impl_->config);
  detector->read(magnified, impl_->families, found);
  impl_->idle.give_back(std::move(detector));

  const Pixel origin(part.x, part.y);
  std::erase_if(found, [&](FoundTag& tag) {
    // The library's pixels begin where they begin, ours in their middle.
    for (Pixel& corner : tag.quad_px) corner = corner / times - Pixel(0.5, 0.5);
    const auto fit = fit_tag(grey, draw(*impl_->codes.at(tag.family), tag.id), tag.quad_px);
    if (!fit || fit->score < impl_->config.min_score) return true;
    tag.corners_px = fit->corners_px;
    for (std::size_t i = 0; i < 4; ++i) {
      tag.quad_px[i] += origin;
      tag.corners_px[i] += origin;
    }
    tag.covariance = fit->covariance;
    tag.score = fit->score;
    return false;
  });
  std::sort(found.begin(), found.end(), before);
  return found;
}

}  // namespace skylight
