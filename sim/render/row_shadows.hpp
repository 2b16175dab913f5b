// The shadows in one row of a picture: the actors' on the floor, and those that pass over everything.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "sim/render/lanes.hpp"
#include "sim/render/rows.hpp"

namespace skylight::sim {

inline void mark_changed(const Scene& scene, int y, const Change& change) {
  if (scene.changed != nullptr) (*scene.changed)[static_cast<std::size_t>(y)].push_back(change);
}

/// The next stretch may begin right behind this one.
[[gnu::always_inline]] inline void store_within(float* to, const F8& v, int count) {
  if (count >= kLanes) {
    store(to, v);
  } else {
    std::memcpy(to, &v, static_cast<std::size_t>(count) * sizeof(float));
  }
}

/// One row after the other; its memory is used again.
class RowShadows {
 public:
  explicit RowShadows(const Scene& scene) : scene_(scene), eye_(scene.view.eye.cast<float>()) {
    const auto width = static_cast<std::size_t>(scene.mean->cols + kLanes);
    left_.resize(width);
    lamps_left_.resize(scene.view.light->lamps().size() * width);
    floor_x_.resize(width);
    floor_y_.resize(width);
  }

  /// Before the bodies.
  [[gnu::always_inline]] inline void paint(int y) {
    y_ = y;
    shadows();
  }
  /// After them.
  void pass(int y) {
    y_ = y;
    passing();
  }

 private:
  /// What the actors' upper sides fill: whatever lies on the floor below is not seen.
  void find_filled() {
    filled_.clear();
    for (const Placed* actor : scene_.moving) {
      if (y_ < actor->body_rows().begin || y_ >= actor->body_rows().end) continue;
      Span most;
      for (std::size_t i = 0; i < actor->look().solids().size(); ++i) {
        const Span span = actor->inner(i).at(y_);
        if (span.end - span.begin > most.end - most.begin) most = span;
      }
      if (!most.empty() && !meets_fixed(most)) filled_.push_back(most);
    }
    std::sort(filled_.begin(), filled_.end(), [](const Span& a, const Span& b) { return a.begin < b.begin; });
  }
  bool meets_fixed(const Span& span) const {
    return std::any_of(scene_.fixed.begin(), scene_.fixed.end(), [&](const Placed* actor) {
      if (y_ < actor->body_rows().begin || y_ >= actor->body_rows().end) return false;
      for (std::size_t i = 0; i < actor->look().solids().size(); ++i) {
        if (actor->outer(i).at(y_).meets(span)) return true;
      }
      return false;
    });
  }
  /// The stretches of this row that any shadow may touch, apart from each other, but for what is filled.
  void find_stretches() {
    find_shaded();
    if (stretches_.empty()) return;
    find_filled();
    if (filled_.empty()) return;
    shaded_.swap(stretches_);
    stretches_.clear();
    for (Change rest : shaded_) {
      for (const Span& hole : filled_) {
        if (!hole.meets(rest.span)) continue;
        if (hole.begin > rest.span.begin) stretches_.push_back({{rest.span.begin, hole.begin}, rest.actor});
        rest.span.begin = hole.end;
        if (rest.span.empty()) break;
      }
      if (!rest.span.empty()) stretches_.push_back(rest);
    }
  }
  void find_shaded() {
    stretches_.clear();
    for (const Placed* actor : scene_.moving) {
      for (const ShadowArea& area : actor->shadows()) {
        const Span span = area.outline.at(y_);
        if (!span.empty()) stretches_.push_back({span, actor->actor()});
      }
    }
    std::stable_sort(stretches_.begin(), stretches_.end(),
                     [](const Change& a, const Change& b) { return a.span.begin < b.span.begin; });
    std::size_t kept = 0;
    for (const Change& one : stretches_) {
      if (kept > 0 && one.span.begin <= stretches_[kept - 1].span.end) {
        Span& span = stretches_[kept - 1].span;
        span.end = std::max(span.end, one.span.end);
      } else {
        stretches_[kept++] = one;
      }
    }
    stretches_.resize(kept);
  }

  [[gnu::always_inline]] inline void shadows() {
    find_stretches();
    const std::size_t lamps = scene_.view.light->lamps().size();
    const std::size_t width = left_.size();
    const float* ray_x = scene_.rays->row(0, y_);
    const float* ray_y = scene_.rays->row(1, y_);
    const float* ray_z = scene_.rays->row(2, y_);
    for (const auto& [span, actor] : stretches_) {
      for (int x = span.begin; x < span.end; x += kLanes) {
        const F8 down = -eye_.z() / load(ray_z + x);
        store(&floor_x_[at(x)], eye_.x() + down * load(ray_x + x));
        store(&floor_y_[at(x)], eye_.y() + down * load(ray_y + x));
        store(&left_[at(x)], all(1.0F));
        for (std::size_t l = 0; l < lamps; ++l) store(&lamps_left_[l * width + at(x)], all(1.0F));
      }
    }
    for (const Placed* actor : scene_.moving) {
      for (const ShadowArea& area : actor->shadows()) {
        const Span span = area.outline.at(y_);
        if (span.empty()) continue;
        for (const Change& stretch : stretches_) {
          const Span part{std::max(span.begin, stretch.span.begin), std::min(span.end, stretch.span.end)};
          if (!part.empty()) darken(*actor, area.lamp, part);
        }
      }
    }
    for (const Change& span : stretches_) {
      apply_shadows(span.span);
      mark_changed(scene_, y_, span);
    }
  }

  [[gnu::always_inline]] inline void darken(const Placed& actor, const std::optional<std::size_t>& lamp,
                                            const Span& span) {
    if (!lamp) {
      const auto darkness = static_cast<float>(scene_.contact_shadow);
      for (const ShadowCaster& caster : actor.casters()) {
        if (!touches_floor(caster.shape)) continue;
        for (int x = span.begin; x < span.end; x += kLanes) {
          const F8 left = contact_left(caster, darkness, load(&floor_x_[at(x)]), load(&floor_y_[at(x)]));
          store_within(&left_[at(x)], load(&left_[at(x)]) * left, span.end - x);
        }
      }
      return;
    }
    float* row = &lamps_left_[*lamp * left_.size()];
    const LampAbove above = lamp_above(scene_.view.light->lamps()[*lamp], 0.0);
    for (int x = span.begin; x < span.end; x += kLanes) {
      const F8 fx = load(&floor_x_[at(x)]);
      const F8 fy = load(&floor_y_[at(x)]);
      F8 dark = all(0.0F);  // its solids are one body: what two of them hide is hidden once
      for (const ShadowCaster& caster : actor.casters())
        dark = most(dark, hidden(caster, above, 0.0F, fx, fy));
      store_within(row + x, load(row + x) * (1.0F - dark), span.end - x);
    }
  }

  [[gnu::always_inline]] inline void apply_shadows(const Span& span) {
    const std::size_t lamps = scene_.view.light->lamps().size();
    const std::uint8_t* floor = scene_.standing->floor.ptr(y_);
    auto* mean = scene_.mean->ptr<std::uint16_t>(y_);
    for (int x = span.begin; x < span.end; x += kLanes) {
      F8 factor = all(1.0F);
      for (std::size_t l = 0; l < lamps; ++l) {
        F8 share = all(0.0F);
        const float* shares = scene_.standing->shares[l].ptr<float>(y_) + x;
        std::memcpy(&share, shares, at(std::min(kLanes, span.end - x)) * sizeof(float));
        factor -= share * (1.0F - load(&lamps_left_[l * left_.size() + at(x)]));
      }
      alignas(32) std::array<float, kLanes> factors;
      store(factors.data(), factor);
      const int count = std::min(kLanes, span.end - x);
      for (int i = 0; i < count; ++i) {
        if (floor[x + i] == 0) continue;
        if (scene_.into != nullptr) keep_shares(x + i, factors[at(i)]);
        const float left = factors[at(i)] * left_[at(x + i)];
        for (int c = 3 * (x + i); c < 3 * (x + i) + 3; ++c)
          mean[c] = static_cast<std::uint16_t>(static_cast<float>(mean[c]) * left + 0.5F);
      }
    }
  }

  /// What is left of each lamp's share where something that stands keeps some of it off.
  void keep_shares(int x, float factor) {
    for (std::size_t l = 0; l < scene_.into->shares.size(); ++l)
      scene_.into->shares[l].ptr<float>(y_)[x] *=
          lamps_left_[l * left_.size() + at(x)] / std::max(factor, 1e-6F);
  }

  /// Share of the light that the bands leave on the floor that a pixel sees.
  float passing_left(int x) const {
    const float ray_z = scene_.rays->row(2, y_)[x];
    if (!(ray_z < 0.0F)) return 1.0F;
    const float down = -eye_.z() / ray_z;
    const float fx = eye_.x() + down * scene_.rays->row(0, y_)[x];
    const float fy = eye_.y() + down * scene_.rays->row(1, y_)[x];
    double left = 1.0;
    for (const PassingShadow& band : *scene_.passing) {
      const double along = std::cos(band.direction_rad) * static_cast<double>(fx) +
                           std::sin(band.direction_rad) * static_cast<double>(fy) - band.centre_m;
      const double share = 2.0 * std::abs(along) / band.width_m;
      if (share < 1.0) left *= 1.0 - band.darkness * 0.5 * (1.0 + std::cos(std::numbers::pi * share));
    }
    return static_cast<float>(left);
  }

  void passing() {
    if (scene_.passing == nullptr || scene_.passing->empty()) return;
    constexpr int kApart = 8;  // px: a band is soft, in between it changes evenly
    const int width = scene_.mean->cols;
    auto* mean = scene_.mean->ptr<std::uint16_t>(y_);
    float before = passing_left(0);
    int changed_from = width;
    int changed_to = 0;
    for (int x = 0; x < width; x += kApart) {
      const float after = passing_left(std::min(x + kApart, width - 1));
      if (before < 1.0F || after < 1.0F) {
        const int end = std::min(x + kApart, width);
        changed_from = std::min(changed_from, x);
        changed_to = end;
        for (int i = x; i < end; ++i) {
          const float factor = before + (after - before) * static_cast<float>(i - x) / kApart;
          for (int c = 3 * i; c < 3 * i + 3; ++c)
            mean[c] = static_cast<std::uint16_t>(static_cast<float>(mean[c]) * factor + 0.5F);
        }
      }
      before = after;
    }
    if (changed_from < changed_to) mark_changed(scene_, y_, {{changed_from, changed_to}});
  }

  static std::size_t at(int x) { return static_cast<std::size_t>(x); }

  const Scene& scene_;
  Eigen::Vector3f eye_;
  int y_ = 0;
  std::vector<float> left_, lamps_left_, floor_x_, floor_y_;
  std::vector<Change> stretches_, shaded_;
  std::vector<Span> filled_;
};

}  // namespace skylight::sim
