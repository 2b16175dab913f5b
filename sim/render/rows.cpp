#include "sim/render/rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sim/camera/noise.hpp"
#include "sim/render/pixels.hpp"
#include "sim/render/row_shadows.hpp"

namespace skylight::sim {
namespace {

/// A solid of an actor in one row.
struct Item {
  const Placed* actor = nullptr;
  std::size_t solid = 0;
  bool fixed = false;
  std::size_t slot = 0;  ///< of its actor's stances
  float top = 0.0F;
  Span outer, inner;
};

/// The solids of one actor that a stretch of a row may show: items first to first + count - 1.
struct Group {
  const Stances* stances = nullptr;
  bool fixed = false;
  std::size_t first = 0;
  std::size_t count = 0;
};

struct Color3 {
  float b = 0.0F, g = 0.0F, r = 0.0F;
};

class RowPainter {
 public:
  explicit RowPainter(const Scene& scene)
      : scene_(scene), eye_(scene.view.eye.cast<float>()), shadows_(scene) {
    const auto width = static_cast<std::size_t>(scene.mean->cols + kLanes);
    for (std::vector<float>& row : on_plane_) row.resize(width + kLanes);
  }

  [[gnu::always_inline]] inline void paint(int y) {
    y_ = y;
    restore();
    shadows_.paint(y);
    bodies();
    shadows_.pass(y);
  }

 private:
  // ---- What the last frame changed.

  void restore() {
    if (scene_.changed == nullptr) return;
    std::vector<Change>& changes = (*scene_.changed)[static_cast<std::size_t>(y_)];
    std::size_t stay = 0;
    for (const Change& change : changes) {
      if (scene_.kept != nullptr && change.actor < scene_.kept->size() && (*scene_.kept)[change.actor]) {
        changes[stay++] = change;
        continue;
      }
      const Span& span = change.span;
      const auto count = static_cast<std::size_t>(span.end - span.begin);
      std::memcpy(scene_.mean->ptr<std::uint16_t>(y_) + 3 * span.begin,
                  scene_.standing->mean.ptr<std::uint16_t>(y_) + 3 * span.begin,
                  3 * count * sizeof(std::uint16_t));
      if (scene_.metres != nullptr)
        std::memcpy(scene_.metres->ptr<float>(y_) + span.begin,
                    scene_.standing->metres.ptr<float>(y_) + span.begin, count * sizeof(float));
    }
    changes.resize(stay);
  }

  // ---- Bodies.

  void add_items(const Placed& actor, bool fixed, std::vector<Item>& items) {
    if (y_ < actor.body_rows().begin || y_ >= actor.body_rows().end) return;
    for (std::size_t i = 0; i < actor.look().solids().size(); ++i) {
      const Span outer = actor.outer(i).at(y_);
      if (outer.empty()) continue;
      items.push_back({&actor, i, fixed, 0, static_cast<float>(actor.look().solids()[i].max.z()), outer,
                       actor.inner(i).at(y_)});
    }
  }

  [[gnu::always_inline]] inline void bodies() {
    find_clusters();
    fixed_items_.clear();
    if (clusters_.empty()) return;
    for (const Placed* actor : scene_.fixed) add_items(*actor, true, fixed_items_);
    for (std::size_t i = 0; i < 3; ++i)
      planes_[i] = {scene_.rays->row(i, y_ - 1), scene_.rays->row(i, y_), scene_.rays->row(i, y_ + 1)};
    std::size_t begin = 0;
    while (begin < clusters_.size()) {
      Span span = clusters_[begin].first;
      std::size_t end = begin + 1;
      for (; end < clusters_.size() && clusters_[end].first.begin < span.end; ++end)
        span.end = std::max(span.end, clusters_[end].first.end);
      items_.clear();
      for (std::size_t i = begin; i < end; ++i) add_items(*clusters_[i].second, false, items_);
      for (const Item& item : fixed_items_) {
        if (item.outer.meets(span)) items_.push_back(item);
      }
      paint_cluster(span);
      mark_changed(scene_, y_, {span, clusters_[begin].second->actor()});
      begin = end;
    }
  }

  /// The moving actors in this row, from left to right.
  void find_clusters() {
    clusters_.clear();
    for (const Placed* actor : scene_.moving) {
      if (y_ < actor->body_rows().begin || y_ >= actor->body_rows().end) continue;
      Span all_of{};
      for (std::size_t i = 0; i < actor->look().solids().size(); ++i) {
        const Span span = actor->outer(i).at(y_);
        if (span.empty()) continue;
        all_of =
            all_of.empty() ? span : Span{std::min(all_of.begin, span.begin), std::max(all_of.end, span.end)};
      }
      if (!all_of.empty()) clusters_.emplace_back(all_of, actor);
    }
    std::stable_sort(clusters_.begin(), clusters_.end(),
                     [](const auto& a, const auto& b) { return a.first.begin < b.first.begin; });
  }

  /// Cuts the cluster where an outline begins or ends: in between, every pixel may show the same solids.
  [[gnu::always_inline]] inline void paint_cluster(const Span& span) {
    std::size_t slots = 0;
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (i > 0 && items_[i].actor == items_[i - 1].actor) {
        items_[i].slot = items_[i - 1].slot;
      } else {
        items_[i].slot = slots++;
      }
    }
    if (scratch_.size() < slots) scratch_.resize(slots);
    slots_.assign(slots, nullptr);
    for (const Item& item : items_) {
      if (slots_[item.slot] == nullptr)
        slots_[item.slot] = &item.actor->stances(scene_.view, y_, scratch_[item.slot]);
    }
    cuts_.assign({span.begin, span.end});
    for (const Item& item : items_) {
      for (const int cut : {item.outer.begin, item.outer.end, item.inner.begin, item.inner.end}) {
        if (cut > span.begin && cut < span.end) cuts_.push_back(cut);
      }
    }
    std::sort(cuts_.begin(), cuts_.end());
    cuts_.erase(std::unique(cuts_.begin(), cuts_.end()), cuts_.end());
    for (std::size_t i = 0; i + 1 < cuts_.size(); ++i) paint_stretch({cuts_[i], cuts_[i + 1]});
  }

  [[gnu::always_inline]] inline void paint_stretch(const Span& span) {
    // What lies lower than an upper side that fills the pixels cannot be seen there.
    const Item* cover = nullptr;
    for (const Item& item : items_) {
      if (!item.inner.empty() && item.inner.holds(span) && (cover == nullptr || item.top > cover->top))
        cover = &item;
    }
    shown_.clear();
    bool moving = false;
    for (const Item& item : items_) {
      if (!item.outer.meets(span) || (cover != nullptr && &item != cover && item.top <= cover->top)) continue;
      shown_.push_back(item);
      moving = moving || !item.fixed;
    }
    if (!moving) return;
    if (shown_.size() == 1 && cover != nullptr) {
      if (cover->actor->look().plate() == cover->solid) {
        paint_plate(*cover, span);
      } else {
        paint_even(*cover, span);
      }
      depth_of_top(*cover, span);
      return;
    }
    make_groups();
    for (int x = span.begin; x < span.end; ++x) paint_pixel(x);
    depth_of_groups(span);
  }

  void make_groups() {
    groups_.clear();
    for (std::size_t i = 0; i < shown_.size(); ++i) {
      if (i == 0 || shown_[i].slot != shown_[i - 1].slot)
        groups_.push_back({slots_[shown_[i].slot], shown_[i].fixed, i, 0});
      ++groups_.back().count;
    }
  }

  [[gnu::always_inline]] inline void put(int x, float b, float g, float r) {
    auto* mean = scene_.mean->ptr<std::uint16_t>(y_) + 3 * x;
    mean[0] = static_cast<std::uint16_t>(std::min(std::max(b * kGreyOne + 0.5F, 0.0F), 65535.0F));
    mean[1] = static_cast<std::uint16_t>(std::min(std::max(g * kGreyOne + 0.5F, 0.0F), 65535.0F));
    mean[2] = static_cast<std::uint16_t>(std::min(std::max(r * kGreyOne + 0.5F, 0.0F), 65535.0F));
  }

  /// Factor of the light at a place over that which an actor's paints contain.
  float change_of_light(const Placed& actor, int x, float distance) const {
    const Eigen::Vector3d direction(static_cast<double>(planes_[0].at[x]),
                                    static_cast<double>(planes_[1].at[x]),
                                    static_cast<double>(planes_[2].at[x]));
    const Eigen::Vector3d at = scene_.view.eye + static_cast<double>(distance) * direction;
    return static_cast<float>(scene_.view.light->at(at) / std::max(1e-6, actor.light_reference()));
  }

  void paint_even(const Item& item, const Span& span) {
    const std::array<float, 3>& top = item.actor->paint(item.solid).top;
    for (int x = span.begin; x < span.end; ++x) {
      float factor = scene_.view.light->vignette(x, y_);
      if (item.actor->is_large())
        factor *= change_of_light(*item.actor, x, (item.top - eye_.z()) / planes_[2].at[x]);
      put(x, factor * top[0], factor * top[1], factor * top[2]);
    }
  }

  /// Where the rays of a stretch (and one more to each side) meet a level plane so far above the camera: x
  /// and y of this row, of the one above it and of the one below.
  [[gnu::always_inline]] inline void meet_plane(const Span& span, float up) {
    const auto row_of = [](const PlaneRows& rows, int i) {
      return i == 0 ? rows.at : (i == 1 ? rows.above : rows.below);
    };
    for (int i = 0; i < 3; ++i) {
      const float* x = row_of(planes_[0], i);
      const float* y = row_of(planes_[1], i);
      const float* z = row_of(planes_[2], i);
      for (int at_x = span.begin - 1; at_x < span.end + 1; at_x += kLanes) {
        const F8 reach = up / load(z + at_x);
        store(&on_plane_[at(2 * i)][at(at_x - span.begin + 1)], reach * load(x + at_x));
        store(&on_plane_[at(2 * i + 1)][at(at_x - span.begin + 1)], reach * load(y + at_x));
      }
    }
  }

  /// Pixels that show nothing but the plate's upper side: where their rays meet its plane changes evenly.
  [[gnu::always_inline]] inline void paint_plate(const Item& item, const Span& span) {
    const Stances& at_row = *slots_[item.slot];
    const Look& look = item.actor->look();
    const Print::Level& level = look.print().level(item.actor->print_level());
    const PrintPlaces places = print_places(look, level);
    meet_plane(span, item.top - eye_.z());
    for (int x = span.begin; x < span.end; ++x) {
      const auto i = at(x - span.begin) + 1;
      const float gx = on_plane_[0][i];
      const float gy = on_plane_[1][i];
      const float step_xx = 0.5F * (on_plane_[0][i + 1] - on_plane_[0][i - 1]);
      const float step_yx = 0.5F * (on_plane_[1][i + 1] - on_plane_[1][i - 1]);
      const float step_xy = 0.5F * (on_plane_[4][i] - on_plane_[2][i]);
      const float step_yy = 0.5F * (on_plane_[5][i] - on_plane_[3][i]);
      std::array<F8, 2> columns;
      std::array<F8, 2> rows;
      for (std::size_t h = 0; h < 2; ++h) {
        const F8 px = gx + step_xx * offsets_.x[h] + step_xy * offsets_.y[h];
        const F8 py = gy + step_yx * offsets_.x[h] + step_yy * offsets_.y[h];
        const F8 c = load(&at_row.cosine[h * kLanes]);
        const F8 s = load(&at_row.sine[h * kLanes]);
        const F8 local_x = load(&at_row.eye_x[h * kLanes]) + c * px + s * py;
        const F8 local_y = load(&at_row.eye_y[h * kLanes]) + c * py - s * px;
        columns[h] = places.origin_x - local_y * places.per_x;
        rows[h] = places.origin_y - local_x * places.per_y;
      }
      std::array<std::int32_t, 3> sum{};
      add_texels(level, columns, rows, 0xffffU, sum);
      const float mid_x = at_row.mid_eye_x + at_row.mid_cosine * gx + at_row.mid_sine * gy;
      const float mid_y = at_row.mid_eye_y + at_row.mid_cosine * gy - at_row.mid_sine * gx;
      const auto [factor, added] = item.actor->plate_light().at(mid_x, mid_y);
      const float vignette = scene_.view.light->vignette(x, y_);
      const float scale = factor * vignette / static_cast<float>(kSamples * kWeightOne);
      const float more = added * vignette;
      put(x, static_cast<float>(sum[0]) * scale + more, static_cast<float>(sum[1]) * scale + more,
          static_cast<float>(sum[2]) * scale + more);
    }
  }

  /// Adds what the samples in the masks see of an item.
  [[gnu::always_inline]] inline void shade(const Item& item, int x, const std::array<HitLanes, 2>& hits,
                                           const std::array<I8, 2>& seen, Color3& sum) const {
    const Paint& paint = item.actor->paint(item.solid);
    const unsigned met = lanes_of(seen[0]) | lanes_of(seen[1]) << 8U;
    const std::array<I8, 2> on_top{seen[0] & hits[0].top, seen[1] & hits[1].top};
    const unsigned tops = lanes_of(on_top[0]) | lanes_of(on_top[1]) << 8U;
    Color3 color;
    if (met != tops) {
      const F8 count0 = only(seen[0] & ~hits[0].top, hits[0].a);
      const F8 count1 = only(seen[1] & ~hits[1].top, hits[1].a);
      const float normal_x = total(count0 + count1);
      const float normal_y =
          total(only(seen[0] & ~hits[0].top, hits[0].b) + only(seen[1] & ~hits[1].top, hits[1].b));
      const auto count = static_cast<float>(std::popcount(met & ~tops));
      color.b += count * paint.side[0] + normal_x * paint.side_x[0] + normal_y * paint.side_y[0];
      color.g += count * paint.side[1] + normal_x * paint.side_x[1] + normal_y * paint.side_y[1];
      color.r += count * paint.side[2] + normal_x * paint.side_x[2] + normal_y * paint.side_y[2];
    }
    if (tops != 0 && item.actor->look().plate() == item.solid) {
      const Look& look = item.actor->look();
      const Print::Level& level = look.print().level(item.actor->print_level());
      const PrintPlaces places = print_places(look, level);
      std::array<F8, 2> columns;
      std::array<F8, 2> rows;
      for (std::size_t h = 0; h < 2; ++h) {
        columns[h] = places.origin_x - hits[h].b * places.per_x;
        rows[h] = places.origin_y - hits[h].a * places.per_y;
      }
      std::array<std::int32_t, 3> texels{};
      add_texels(level, columns, rows, tops, texels);
      const auto count = static_cast<float>(std::popcount(tops));
      const float mid_x = total(only(on_top[0], hits[0].a) + only(on_top[1], hits[1].a)) / count;
      const float mid_y = total(only(on_top[0], hits[0].b) + only(on_top[1], hits[1].b)) / count;
      const auto [factor, added] = item.actor->plate_light().at(mid_x, mid_y);
      const float scale = factor / static_cast<float>(kWeightOne);
      color.b += static_cast<float>(texels[0]) * scale + added * count;
      color.g += static_cast<float>(texels[1]) * scale + added * count;
      color.r += static_cast<float>(texels[2]) * scale + added * count;
    } else if (tops != 0) {
      const auto count = static_cast<float>(std::popcount(tops));
      color.b += count * paint.top[0];
      color.g += count * paint.top[1];
      color.r += count * paint.top[2];
    }
    float factor = 1.0F;
    if (item.actor->is_large()) {
      const float distance = total(only(seen[0], hits[0].distance) + only(seen[1], hits[1].distance));
      factor = change_of_light(*item.actor, x, distance / static_cast<float>(std::popcount(met)));
    }
    sum.b += factor * color.b;
    sum.g += factor * color.g;
    sum.r += factor * color.r;
  }

  [[gnu::always_inline]] inline void shade_all(int x, bool fixed, const std::array<HitLanes, 2>& hits,
                                               Color3& sum) const {
    for (std::size_t i = 0; i < shown_.size(); ++i) {
      if (shown_[i].fixed != fixed) continue;
      const auto number = static_cast<std::int32_t>(i);
      const std::array<I8, 2> seen{hits[0].solid == number, hits[1].solid == number};
      if ((lanes_of(seen[0]) | lanes_of(seen[1])) != 0) shade(shown_[i], x, hits, seen, sum);
    }
  }

  [[gnu::always_inline]] inline void trace(const SampleRays& rays, bool fixed,
                                           std::array<HitLanes, 2>& hits) const {
    for (const Group& group : groups_) {
      if (group.fixed != fixed) continue;
      for (std::size_t h = 0; h < 2; ++h) {
        RayLanes ray;
        turn_rays(rays, *group.stances, h, ray);
        for (std::size_t i = group.first; i < group.first + group.count; ++i)
          meet(shown_[i].actor->look().solids()[shown_[i].solid], ray, static_cast<int>(i), hits[h]);
      }
    }
  }

  static unsigned samples_that_met(const std::array<HitLanes, 2>& hits) {
    return lanes_of(hits[0].solid >= 0) | lanes_of(hits[1].solid >= 0) << 8U;
  }

  [[gnu::always_inline]] inline void paint_pixel(int x) {
    SampleRays rays;
    for (std::size_t h = 0; h < 2; ++h) {
      rays.x[h] = spread(planes_[0], x, offsets_.x[h], offsets_.y[h]);
      rays.y[h] = spread(planes_[1], x, offsets_.x[h], offsets_.y[h]);
      rays.z[h] = spread(planes_[2], x, offsets_.x[h], offsets_.y[h]);
    }
    std::array<HitLanes, 2> hits;
    Color3 standing;  // what the samples see of what stands, before the actors
    unsigned stood = 0;
    if (!fixed_items_.empty()) {
      trace(rays, true, hits);
      stood = samples_that_met(hits);
      if (stood != 0) shade_all(x, true, hits, standing);
    }
    trace(rays, false, hits);
    const unsigned met = samples_that_met(hits);
    Color3 sum;
    shade_all(x, false, hits, sum);
    if (!(stood == 0 ? met != 0 : any_moving(hits))) return;
    const float vignette = scene_.view.light->vignette(x, y_);
    Color3 behind = put_before(x);
    if (stood != 0) {
      // The standing picture is the mean of things and floor: the floor's part alone shows beside them.
      Color3 front;
      shade_all(x, true, hits, front);
      sum.b += front.b;
      sum.g += front.g;
      sum.r += front.r;
      const int bare = static_cast<int>(kSamples) - std::popcount(stood);
      const float per = bare > 0 ? 1.0F / static_cast<float>(bare) : 0.0F;
      behind.b = std::max(0.0F, (static_cast<float>(kSamples) * behind.b - vignette * standing.b) * per);
      behind.g = std::max(0.0F, (static_cast<float>(kSamples) * behind.g - vignette * standing.g) * per);
      behind.r = std::max(0.0F, (static_cast<float>(kSamples) * behind.r - vignette * standing.r) * per);
    }
    const auto misses = static_cast<float>(static_cast<int>(kSamples) - std::popcount(met));
    constexpr float kShare = 1.0F / static_cast<float>(kSamples);
    put(x, (vignette * sum.b + misses * behind.b) * kShare, (vignette * sum.g + misses * behind.g) * kShare,
        (vignette * sum.r + misses * behind.r) * kShare);
  }

  bool any_moving(const std::array<HitLanes, 2>& hits) const {
    for (std::size_t i = 0; i < shown_.size(); ++i) {
      const auto number = static_cast<std::int32_t>(i);
      if (!shown_[i].fixed && (lanes_of(hits[0].solid == number) | lanes_of(hits[1].solid == number)) != 0)
        return true;
    }
    return false;
  }

  /// Grey levels of what is in the picture already.
  Color3 put_before(int x) const {
    const auto* mean = scene_.mean->ptr<std::uint16_t>(y_) + 3 * x;
    constexpr float kUnit = 1.0F / static_cast<float>(kGreyOne);
    return {static_cast<float>(mean[0]) * kUnit, static_cast<float>(mean[1]) * kUnit,
            static_cast<float>(mean[2]) * kUnit};
  }

  // ---- Depth.

  /// Component of a ray along the camera's axis.
  [[gnu::always_inline]] inline F8 along_axis(int x) const {
    const Eigen::Vector3f axis = scene_.axis.cast<float>();
    return axis.x() * load(planes_[0].at + x) + axis.y() * load(planes_[1].at + x) +
           axis.z() * load(planes_[2].at + x);
  }

  [[gnu::always_inline]] inline void depth_of_top(const Item& item, const Span& span) {
    if (scene_.into != nullptr) cover_floor(span);
    if (scene_.metres == nullptr) return;
    float* metres = scene_.metres->ptr<float>(y_);
    const float down = item.top - eye_.z();
    for (int x = span.begin; x < span.end; x += kLanes)
      store_within(metres + x, down / load(planes_[2].at + x) * along_axis(x), span.end - x);
  }

  [[gnu::always_inline]] inline void depth_of_groups(const Span& span) {
    if (scene_.metres == nullptr) return;
    float* metres = scene_.metres->ptr<float>(y_);
    for (int x = span.begin; x < span.end; x += kLanes) {
      HitLanes hit;
      for (const Group& group : groups_) {
        const Stances& at_row = *group.stances;
        RayLanes ray;
        const F8 dx = load(planes_[0].at + x);
        const F8 dy = load(planes_[1].at + x);
        ray.eye_x = all(at_row.mid_eye_x);
        ray.eye_y = all(at_row.mid_eye_y);
        ray.eye_z = all(at_row.eye_z);
        ray.x = at_row.mid_cosine * dx + at_row.mid_sine * dy;
        ray.y = at_row.mid_cosine * dy - at_row.mid_sine * dx;
        ray.z = load(planes_[2].at + x);
        invert(ray);
        for (std::size_t i = group.first; i < group.first + group.count; ++i)
          meet(shown_[i].actor->look().solids()[shown_[i].solid], ray, static_cast<int>(i), hit);
      }
      const F8 seen = hit.distance * along_axis(x);
      for (int i = 0; i < std::min(kLanes, span.end - x); ++i) {
        if (hit.solid[i] < 0 || shown_[static_cast<std::size_t>(hit.solid[i])].fixed) continue;
        metres[x + i] = seen[i];
        if (scene_.into != nullptr) cover_floor({x + i, x + i + 1});
      }
    }
  }

  /// What stands there is no floor: no shadows of the moving actors fall on it.
  void cover_floor(const Span& span) {
    for (int x = span.begin; x < span.end; ++x) {
      scene_.into->floor.ptr(y_)[x] = 0;
      for (cv::Mat& share : scene_.into->shares) share.ptr<float>(y_)[x] = 0.0F;
    }
  }

  static std::size_t at(int x) { return static_cast<std::size_t>(x); }

  const Scene& scene_;
  Eigen::Vector3f eye_;
  RowShadows shadows_;
  SampleOffsets offsets_;
  int y_ = 0;
  std::array<PlaneRows, 3> planes_{};
  std::array<std::vector<float>, 6> on_plane_;
  std::vector<Item> items_, fixed_items_, shown_;
  std::vector<Group> groups_;
  std::vector<std::pair<Span, const Placed*>> clusters_;
  std::vector<Stances> scratch_;
  std::vector<const Stances*> slots_;
  std::vector<int> cuts_;
};

// The same code for processors that have AVX2 and for others: the bytes are equal (lanes.hpp).
[[gnu::always_inline]] inline void paint(const Scene& scene, int begin, int end) {
  RowPainter painter(scene);
  for (int y = begin; y < end; ++y) painter.paint(y);
}
#if defined(__x86_64__)
[[gnu::target("avx2")]] void paint_avx2(const Scene& scene, int begin, int end) {
  paint(scene, begin, end);
}
#endif
void paint_base(const Scene& scene, int begin, int end) {
  paint(scene, begin, end);
}

}  // namespace

void paint_rows(const Scene& scene, int begin, int end) {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2") != 0;
  if (avx2) {
    paint_avx2(scene, begin, end);
    return;
  }
#endif
  paint_base(scene, begin, end);
}

}  // namespace skylight::sim
