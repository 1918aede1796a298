// The ray tracer of builds without Embree.

#include <algorithm>
#include <cassert>
#include <limits>

#include "runtime/rays/opacity_passage.h"
#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle_tree.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce {
namespace {

constexpr float kStop = -std::numeric_limits<float>::infinity();  // as the new end of a ray

}  // namespace

struct RayTracer::Impl {
  TriangleTree tree;
  OpacityMaps opacity;
  std::vector<float> transmitted;  ///< [triangles] mean fraction of light; empty without maps
  float offset_distance;

  Impl(std::span<const Float3> position, std::span<const Uint3> triangle, const OpacityMaps& maps)
      : tree(position, triangle), opacity(maps), offset_distance(ray_offset_distance(position)) {
    if (opacity.empty()) return;
    for (std::uint32_t t = 0; t < triangle.size(); ++t) {
      transmitted.push_back(
          opacity.of_triangle(t).empty() ? 0 : static_cast<float>(1 - opacity.stopping_part(t)));
    }
  }

  bool stops(const Ray& ray, const Hit& hit) const {
    const auto map = opacity.of_triangle(hit.triangle);
    return map.empty() || stops_by_chance(ray.origin, ray.direction, hit.triangle,
                                          stopped_part(map, hit.u, hit.v));
  }

  /// The fraction of light that gets through a triangle with an opacity map.
  float passed_part(const Hit& hit, PassageDetail detail) const {
    if (detail == PassageDetail::kTriangle) return transmitted[hit.triangle];
    return 1 - stopped_part(opacity.of_triangle(hit.triangle), hit.u, hit.v);
  }
};

RayTracer::RayTracer(std::span<const Float3> position, std::span<const Uint3> triangle,
                     const OpacityMaps& opacity)
    : impl_(std::make_unique<Impl>(position, triangle, opacity)) {}

RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::occluded(std::span<Ray> rays) const {
  for (Ray& ray : rays) {
    const float end = ray.t_far;
    impl_->tree.trace(ray, [&](const Hit& hit) {
      if (!impl_->stops(ray, hit)) return end;
      ray.t_far = kStop;
      return kStop;
    });
  }
}

void RayTracer::transmittance(std::span<Ray> rays, PassageDetail detail,
                              std::span<float> part) const {
  assert(rays.size() == part.size());
  if (impl_->transmitted.empty()) {
    occluded(rays);
    std::ranges::transform(rays, part.begin(),
                           [](const Ray& ray) { return is_occluded(ray) ? 0.0F : 1.0F; });
    return;
  }
  for (std::size_t k = 0; k < rays.size(); ++k) {
    Ray& ray = rays[k];
    const float end = ray.t_far;
    float passed = 1;
    impl_->tree.trace(ray, [&](const Hit& hit) {
      if (!impl_->opacity.of_triangle(hit.triangle).empty()) {
        passed *= impl_->passed_part(hit, detail);
        return end;
      }
      passed = 0;
      ray.t_far = kStop;
      return kStop;
    });
    part[k] = passed;
  }
}

void RayTracer::intersect(std::span<const Ray> rays, std::span<Hit> hits, Passage passage) const {
  assert(rays.size() == hits.size());
  for (std::size_t k = 0; k < rays.size(); ++k) {
    Hit& nearest = hits[k];
    nearest = {};
    nearest.t = rays[k].t_far;
    impl_->tree.trace(rays[k], [&](const Hit& hit) {
      if (passage == Passage::kSolid || impl_->stops(rays[k], hit)) nearest = hit;
      return nearest.t;
    });
    if (nearest.triangle == kNone) nearest = {};
  }
}

void RayTracer::intersect_all(const Ray& ray, std::vector<Hit>& hits) const {
  impl_->tree.trace(ray, [&](const Hit& hit) {
    if (impl_->stops(ray, hit)) hits.push_back(hit);
    return ray.t_far;
  });
}

float RayTracer::offset_distance() const {
  return impl_->offset_distance;
}

}  // namespace rebounce
