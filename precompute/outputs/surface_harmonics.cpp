#include "precompute/outputs/surface_harmonics.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <vector>

#include "precompute/base/parallel_loop.h"
#include "precompute/outputs/harmonic_view.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr std::size_t kPatchBatch = 256;  // patches between two reports of progress

using PatchView = HarmonicView<kLinearHarmonicCount>;  // the view of one patch

/// A direction around `normal`, uniform over the hemisphere.
glm::dvec3 hemisphere_direction(const glm::dvec3& normal, const glm::dvec2& s) {
  const double r = std::sqrt(1 - s.x * s.x), phi = 2 * std::numbers::pi * s.y;
  return frame_around(normal) * glm::dvec3(r * std::cos(phi), r * std::sin(phi), s.x);
}

class PatchViewer {
 public:
  PatchViewer(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
              const RayTracer& tracer, const SurfaceHarmonicSettings& settings)
      : mesh_(mesh),
        viewer_(mesh, shown_patch, tracer),
        tracer_(tracer),
        settings_(settings),
        points_(static_cast<std::size_t>(settings.ray_count)),
        rays_(points_.size()),
        hits_(points_.size()) {}

  PatchView look_up(std::span<const std::uint32_t> triangles, std::uint32_t patch) {
    const std::uint64_t bits = mix_bits(settings_.seed ^ mix_bits(patch));
    spread_points(mesh_, triangles, unit_square(bits), points_);
    const PointSequence directions = direction_sequence(unit_square(mix_bits(bits)));
    for (std::uint32_t k = 0; k < rays_.size(); ++k) {
      const auto& [position, normal] = points_[k];
      Ray& ray = rays_[k] = Ray{};
      ray.origin = tracer_.offset_point(position, normal);
      ray.direction = to_float3(hemisphere_direction(to_dvec3(normal), directions[k]));
      ray.t_near = 0;
      ray.t_far = std::numeric_limits<float>::infinity();
    }
    viewer_.trace(rays_, hits_);
    return viewer_.sum_up(rays_, hits_,
                          2 * std::numbers::pi_v<float> / static_cast<float>(rays_.size()));
  }

 private:
  const DisplayMesh& mesh_;
  HarmonicViewer<kLinearHarmonicCount> viewer_;
  const RayTracer& tracer_;
  const SurfaceHarmonicSettings& settings_;
  std::vector<PatchPoint> points_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
};

}  // namespace

SurfaceHarmonics trace_surface_harmonics(const TransferData& data,
                                         std::span<const std::uint32_t> shown_patch,
                                         const RayTracer& tracer,
                                         const SurfaceHarmonicSettings& settings,
                                         const Progress& progress) {
  if (settings.ray_count < kFewestHarmonicRays)
    throw Error("surface harmonics: a patch needs at least 16 rays");
  const std::size_t n = data.patches.size();
  const PatchTriangles triangles(data.mesh.triangle_patch, n);
  SurfaceHarmonics harmonics;
  harmonics.entry_begin = harmonics.sky_cells.entry_begin = {0};
  std::vector<PatchView> views;
  for (std::size_t first = 0; first < n; first += kPatchBatch) {
    report_progress(progress, static_cast<double>(first) / static_cast<double>(n));
    const std::size_t count = std::min(kPatchBatch, n - first);
    views.resize(count);
    parallel_loop(
        count, 4, [&] { return PatchViewer(data.mesh, shown_patch, tracer, settings); },
        [&](std::size_t k, PatchViewer& viewer) {
          views[k] = viewer.look_up(triangles[first + k], static_cast<std::uint32_t>(first + k));
        });
    for (const PatchView& view : views) {
      append_view(view, "the patches see too much for one file; ask for fewer rays of each",
                  harmonics);
    }
  }
  return harmonics;
}

}  // namespace rebounce
