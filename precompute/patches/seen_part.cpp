#include "precompute/patches/seen_part.h"

#include <algorithm>
#include <vector>

#include "precompute/sampling/hemisphere_rays.h"

namespace rebounce {
namespace {

// What sees less than the first counts less; nothing counts less than the second.
constexpr double kFullView = 0.25, kLeastImportance = 1.0 / 64;

}  // namespace

double seen_part(const TriangleCorners& corners, const RayTracer& tracer, std::uint32_t count,
                 std::uint64_t seed) {
  std::vector<Ray> rays(count);
  make_hemisphere_rays(corners, front_normal(corners), tracer, mix_bits(seed), rays);
  tracer.occluded(rays);
  return static_cast<double>(std::ranges::count_if(rays, is_occluded)) / count;
}

double importance(double seen_part) {
  return std::clamp(seen_part / kFullView, kLeastImportance, 1.0);
}

}  // namespace rebounce
