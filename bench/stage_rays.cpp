#include "stage_rays.h"

#include <algorithm>

#include "escape.h"
#include "raw_exchange.h"
#include "shadow_rays.h"

namespace rebounce::bench {
namespace {

std::uint64_t hidden_among(std::span<const Ray> rays) {
  return static_cast<std::uint64_t>(std::ranges::count_if(rays, is_occluded));
}

}  // namespace

StageRays make_stage_rays(const PatchModel& model, const RayTracer& tracer,
                          const FormFactorSettings& settings, std::uint32_t row_step) {
  const PatchTriangles patch_triangles(model.mesh.triangle_patch, model.patches.size());
  const PatchGeometry geometry(model, tracer);
  const ShadowRays shadow_rays(geometry, settings.seed, settings.kernel_tolerance);
  StageRays result;
  std::vector<FacingPatch> facing, mixed, large_mixed;
  std::vector<Ray> rays;
  std::vector<float> transmitted;
  EscapeScratch escape;
  const auto add_shadow_stream = [&](std::uint32_t row, const std::vector<FacingPatch>& pairs,
                                     int count, bool probe) {
    if (probe) {
      shadow_rays.make_probe_rays(row, pairs, count, rays);
    } else {
      shadow_rays.make_rays(row, pairs, count, rays);
    }
    result.shadow.push_back(rays);
    result.shadow_count += rays.size();
    transmitted.resize(rays.size());
    tracer.transmittance(rays, PassageDetail::kTriangle, transmitted);
    result.hidden_count += hidden_among(rays);
  };
  for (std::uint32_t row = 0; row < geometry.patch_count(); row += row_step) {
    shadow_rays.find_facing(
        row, facing, [&](std::uint32_t column) { return !is_coarse_pair(geometry, row, column); });
    add_shadow_stream(row, facing, settings.probe_rays, true);
    mixed.clear();
    large_mixed.clear();
    const auto probe_rays = static_cast<std::size_t>(settings.probe_rays);
    for (std::size_t p = 0; p < facing.size(); ++p) {
      const auto agreement =
          ShadowRays::agreement(std::span(rays).subspan(p * probe_rays, probe_rays),
                                std::span(transmitted).subspan(p * probe_rays, probe_rays));
      if (agreement != ShadowRays::Agreement::kMixed) continue;
      (is_large_pair(geometry, row, facing[p]) ? large_mixed : mixed).push_back(facing[p]);
    }
    add_shadow_stream(row, mixed, settings.full_rays, false);
    add_shadow_stream(row, large_mixed, kLargeFactor * settings.full_rays, false);
    measure_escape(model, patch_triangles[row], row, tracer, settings.hemisphere_rays,
                   settings.seed, escape);
    result.escape.push_back(escape.rays);
    result.escape_count += escape.rays.size();
  }
  return result;
}

}  // namespace rebounce::bench
