#include "bench/stage_rays.h"

#include <algorithm>
#include <utility>

#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/raw_exchange.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce::bench {
namespace {

class StageRayMaker {
 public:
  StageRayMaker(const PatchModel& model, const RayTracer& tracer,
                const FormFactorSettings& settings)
      : model_(model),
        tracer_(tracer),
        settings_(settings),
        patch_triangles_(model.mesh.triangle_patch, model.patches.size()),
        geometry_(model, tracer),
        shadow_rays_(geometry_, settings.seed, settings.kernel_tolerance) {}

  StageRays run(std::uint32_t row_step) {
    for (std::uint32_t row = 0; row < geometry_.patch_count(); row += row_step) {
      add_shadow_rays(row);
      add_escape_rays(row);
    }
    return std::move(result_);
  }

 private:
  void add_shadow_rays(std::uint32_t row) {
    const auto is_fine = [&](std::uint32_t column) {
      return !is_coarse_pair(geometry_, row, column);
    };
    shadow_rays_.find_facing(row, facing_, is_fine);
    shadow_rays_.make_probe_rays(row, facing_, settings_.probe_rays, rays_);
    add_shadow_stream();
    std::vector<FacingPatch> mixed, large_mixed;
    const auto probe_rays = static_cast<std::size_t>(settings_.probe_rays);
    for (std::size_t p = 0; p < facing_.size(); ++p) {
      const auto agreement =
          ShadowRays::agreement(std::span(rays_).subspan(p * probe_rays, probe_rays),
                                std::span(transmitted_).subspan(p * probe_rays, probe_rays));
      if (agreement != ShadowRays::Agreement::kMixed) continue;
      (is_large_pair(geometry_, row, facing_[p]) ? large_mixed : mixed).push_back(facing_[p]);
    }
    shadow_rays_.make_rays(row, mixed, settings_.full_rays, rays_);
    add_shadow_stream();
    shadow_rays_.make_rays(row, large_mixed, kLargeFactor * settings_.full_rays, rays_);
    add_shadow_stream();
  }

  /// Of rays_, which are traced to know what they meet.
  void add_shadow_stream() {
    result_.shadow.push_back(rays_);
    result_.shadow_count += rays_.size();
    transmitted_.resize(rays_.size());
    tracer_.transmittance(rays_, PassageDetail::kTriangle, transmitted_);
    result_.hidden_count += static_cast<std::uint64_t>(std::ranges::count_if(rays_, is_occluded));
  }

  void add_escape_rays(std::uint32_t row) {
    measure_escape(model_, patch_triangles_[row], row, tracer_, settings_.hemisphere_rays,
                   settings_.seed, escape_);
    result_.escape.push_back(escape_.rays);
    result_.escape_count += escape_.rays.size();
  }

  const PatchModel& model_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  PatchTriangles patch_triangles_;
  PatchGeometry geometry_;
  ShadowRays shadow_rays_;
  std::vector<FacingPatch> facing_;
  std::vector<Ray> rays_;
  std::vector<float> transmitted_;
  EscapeScratch escape_;
  StageRays result_;
};

}  // namespace

StageRays make_stage_rays(const PatchModel& model, const RayTracer& tracer,
                          const FormFactorSettings& settings, std::uint32_t row_step) {
  return StageRayMaker(model, tracer, settings).run(row_step);
}

}  // namespace rebounce::bench
