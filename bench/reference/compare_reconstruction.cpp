#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/reference/compare.h"
#include "bench/reference/error_sum.h"
#include "bench/reference/mesh_value.h"
#include "bench/reference/scene_surface.h"
#include "precompute/patches/lit_sides.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "rebounce/error.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/float3_glm.h"
#include "transfer/operator/receiver_products.h"

namespace rebounce::reference {
namespace {

/// Of faces that meet or cross at a place, those are meant whose normal is nearly the point's.
constexpr double kSameSideCosine = 0.99;

/// A point whose view is back faces by more than this is hidden: the floor under a box, or a
/// ceiling a hair's breadth above a lamp. What the mesh shows there, nobody sees.
constexpr float kHidden = 0.98F;

/// A point is seen if more than this part of its rays goes on for this part of the root of the
/// area.
constexpr double kLeastSeen = 0.05, kSight = 1.0 / 64;

constexpr std::size_t kSightRays = 256;

/// Finds points of the scene on the display mesh.
class MeshLocator {
 public:
  /// Both must outlive it.
  MeshLocator(const DisplayMesh& mesh, const RayTracer& tracer) : mesh_(mesh), tracer_(tracer) {}

  /// The triangle of `point`, or kNone where the mesh has no such side. Of copies that lie in one
  /// another one that has a patch, if any has.
  std::uint32_t locate(const SurfacePoint& point) {
    find_coincident_sides(
        tracer_, point.position, point.normal, kNone,
        [&](std::uint32_t t) { return mesh_.back_triangle[t] != kNone; }, hits_, sides_);
    std::uint32_t found = kNone;
    for (const CoincidentSide& side : sides_) {
      const std::uint32_t t = side.front ? side.triangle : mesh_.back_triangle[side.triangle];
      const glm::dvec3 normal = front_normal(corners_of(mesh_, t));
      if (glm::dot(normal, to_dvec3(point.normal)) < kSameSideCosine) continue;
      if (found == kNone || mesh_.triangle_patch[found] == kNone) found = t;
    }
    return found;
  }

 private:
  const DisplayMesh& mesh_;
  const RayTracer& tracer_;
  std::vector<Hit> hits_;
  std::vector<CoincidentSide> sides_;
};

/// Tells which points are seen from afar.
class Sight {
 public:
  Sight(const PatchTable& patches, const RayTracer& tracer)
      : far_(kSight * std::sqrt(std::accumulate(patches.area.begin(), patches.area.end(), 0.0))),
        tracer_(tracer),
        rays_(kSightRays),
        hits_(kSightRays) {}

  bool sees(const SurfacePoint& point) {
    from_.assign(kSightRays, {point.position, point.normal});
    make_hemisphere_rays(from_, tracer_, {0.5, 0.5}, rays_);
    for (Ray& ray : rays_) ray.t_far = static_cast<float>(far_);
    tracer_.intersect(rays_, hits_);
    const auto free = std::ranges::count(hits_, kNone, &Hit::triangle);
    return static_cast<double>(free) > kLeastSeen * kSightRays;
  }

 private:
  double far_;  ///< metres
  const RayTracer& tracer_;
  std::vector<PatchPoint> from_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
};

}  // namespace

ReconstructionComparison compare_reconstruction(const TransferData& data,
                                                const RayTracer& mesh_tracer,
                                                std::span<const Float3> indirect_irradiance,
                                                std::span<const SurfacePoint> points,
                                                const IrradianceEstimate& truth,
                                                std::span<const Float3> radiosity) {
  if (indirect_irradiance.size() != data.patches.size() || truth.mean.size() != points.size()) {
    throw Error("comparison of the reconstruction: one entry per patch and point is needed");
  }
  if (data.mesh.weight_begin.size() != data.mesh.position.size() + 1) {
    throw Error("comparison of the reconstruction: the mesh has no reconstruction weights");
  }
  std::vector<Float3> at_vertices(data.mesh.position.size());
  reconstruct_at_vertices(data.mesh, indirect_irradiance, at_vertices);
  if (!radiosity.empty()) {
    ReceiverProducts(data.receiver_rows, data.patches.area).add(radiosity, at_vertices);
  }
  clamp_light(at_vertices);
  MeshLocator locator(data.mesh, mesh_tracer);
  Sight sight(data.patches, mesh_tracer);
  ErrorSum sum, seen;
  ReconstructionComparison comparison;
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::uint32_t triangle = locator.locate(points[k]);
    if (triangle == kNone || truth.absorbed[k] > kHidden) {
      ++left_out;
      continue;
    }
    const Float3 shown =
        to_float3(interpolated(data.mesh, at_vertices, triangle, to_dvec3(points[k].position)));
    comparison.point.push_back(static_cast<std::uint32_t>(k));
    comparison.triangle.push_back(triangle);
    comparison.shown.push_back(shown);
    sum.add(1, shown, truth.mean[k], truth.standard_error[k]);
    if (sight.sees(points[k])) seen.add(1, shown, truth.mean[k], truth.standard_error[k]);
  }
  comparison.relative = sum.result(left_out);
  comparison.seen = seen.result(points.size() - seen.count());
  return comparison;
}

}  // namespace rebounce::reference
