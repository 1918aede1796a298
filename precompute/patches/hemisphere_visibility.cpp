#include "precompute/patches/hemisphere_visibility.h"

#include <algorithm>
#include <vector>

#include "precompute/sampling/hemisphere_rays.h"

namespace rebounce {
namespace {

// A surface that sees less than kFullView counts less; nothing counts less than
// kLeastDensityWeight.
constexpr double kFullView = 0.25, kLeastDensityWeight = 1.0 / 64;

}  // namespace

double hemisphere_visibility(const TriangleCorners& corners, const RayTracer& tracer,
                             std::uint32_t count, std::uint64_t seed) {
  std::vector<Ray> rays(count);
  make_hemisphere_rays(corners, front_normal(corners), tracer, mix_bits(seed), rays);
  tracer.occluded(rays);
  return static_cast<double>(std::ranges::count_if(rays, is_occluded)) / count;
}

double density_weight(double hemisphere_visibility) {
  return std::clamp(hemisphere_visibility / kFullView, kLeastDensityWeight, 1.0);
}

}  // namespace rebounce
