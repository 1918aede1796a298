#include <optional>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/error.h"
#include "reference/compare.h"
#include "reference/error_sum.h"
#include "reference/scene_surface.h"

namespace rebounce::reference {
namespace {

/// Of two faces at the same place, that one is meant whose normal is nearly the point's.
constexpr double kSameSideCosine = 0.99;

/// A point whose view is back faces by more than this is hidden: the floor under a box, or a
/// ceiling a hair's breadth above a lamp. What the mesh shows there, nobody sees.
constexpr float kHidden = 0.98F;

/// A point of the display mesh.
struct MeshPoint {
  std::uint32_t triangle;
  glm::dvec3 weight;  ///< barycentric, of its three vertices
};

/// A short ray straight down through each point.
std::vector<Ray> rays_through(std::span<const SurfacePoint> points, const RayTracer& tracer) {
  std::vector<Ray> rays;
  rays.reserve(points.size());
  for (const SurfacePoint& p : points) {
    Ray ray{};
    ray.origin = tracer.offset_point(p.position, p.normal);
    ray.direction = {-p.normal[0], -p.normal[1], -p.normal[2]};
    ray.t_near = 0;
    ray.t_far = 2 * tracer.offset_distance();
    rays.push_back(ray);
  }
  return rays;
}

/// The weights of the vertices of `corners` at `p`, which lies on the triangle.
glm::dvec3 barycentric_weights(const TriangleCorners& corners, const glm::dvec3& p) {
  const glm::dvec3 ab = corners.b - corners.a, ac = corners.c - corners.a, ap = p - corners.a;
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double squared = glm::dot(normal, normal);
  const double v = glm::dot(glm::cross(ap, ac), normal) / squared;
  const double w = glm::dot(glm::cross(ab, ap), normal) / squared;
  return {1 - v - w, v, w};
}

/// The display triangle on the side that the ray came from; nothing if that side is not there.
std::optional<MeshPoint> locate(const DisplayMesh& mesh, const SurfacePoint& point,
                                const Hit& hit) {
  if (hit.triangle == kNone) return {};
  const std::uint32_t triangle = hit.front ? hit.triangle : mesh.back_triangle[hit.triangle];
  if (triangle == kNone) return {};
  const TriangleCorners corners(mesh.position, mesh.triangle[triangle]);
  if (glm::dot(corners.front_normal(), to_dvec3(point.normal)) < kSameSideCosine) return {};
  return MeshPoint{triangle, barycentric_weights(corners, to_dvec3(point.position))};
}

glm::dvec3 vertex_value(const DisplayMesh& mesh, std::span<const Float3> patch_value,
                        std::uint32_t vertex) {
  glm::dvec3 value(0);
  for (std::uint32_t k = mesh.weight_begin[vertex]; k < mesh.weight_begin[vertex + 1]; ++k) {
    value += static_cast<double>(mesh.weight[k]) * to_dvec3(patch_value[mesh.weight_patch[k]]);
  }
  return value;
}

Float3 reconstruct(const DisplayMesh& mesh, std::span<const Float3> patch_value,
                   const MeshPoint& point) {
  glm::dvec3 value(0);
  for (int corner = 0; corner < 3; ++corner) {
    value += point.weight[corner] *
             vertex_value(mesh, patch_value,
                          mesh.triangle[point.triangle][static_cast<std::size_t>(corner)]);
  }
  return to_float3(value);
}

}  // namespace

RelativeError compare_reconstruction(const TransferData& data, const RayTracer& mesh_tracer,
                                     std::span<const Float3> indirect_irradiance,
                                     std::span<const SurfacePoint> points,
                                     const IrradianceEstimate& truth) {
  if (indirect_irradiance.size() != data.patches.size() || truth.mean.size() != points.size()) {
    throw Error("comparison of the reconstruction: one entry per patch and point is needed");
  }
  if (data.mesh.weight_begin.size() != data.mesh.position.size() + 1) {
    throw Error("comparison of the reconstruction: the mesh has no reconstruction weights");
  }
  const std::vector<Ray> rays = rays_through(points, mesh_tracer);
  std::vector<Hit> hits(rays.size());
  mesh_tracer.intersect(rays, hits);
  ErrorSum sum;
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::optional<MeshPoint> place = locate(data.mesh, points[k], hits[k]);
    if (!place || truth.absorbed[k] > kHidden) {
      ++left_out;
      continue;
    }
    sum.add(1, reconstruct(data.mesh, indirect_irradiance, *place), truth.mean[k],
            truth.standard_error[k]);
  }
  return sum.result(left_out);
}

}  // namespace rebounce::reference
