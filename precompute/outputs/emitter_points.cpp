#include "precompute/outputs/emitter_points.h"

#include <algorithm>
#include <map>
#include <span>

#include "runtime/lights/emitting_material.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

/// Points at equal steps of area over all `triangles`, one triangle after the other.
std::vector<EmitterPoint> spread(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                                 int count) {
  double area = 0;
  for (const std::uint32_t t : triangles) area += area_of(corners_of(mesh, t));
  std::vector<EmitterPoint> points;
  double before = 0;
  for (const std::uint32_t t : triangles) {
    const TriangleCorners corners = corners_of(mesh, t);
    const double end = before + area_of(corners);
    const glm::dvec3 share = front_normal(corners) * (area / count);
    while (std::ssize(points) < count &&
           (static_cast<double>(points.size()) + 0.5) / count * area < end) {
      const auto k = static_cast<std::uint32_t>(points.size());
      const glm::dvec2 place = square_to_triangle(r2_point(k, glm::dvec2(0.5)));
      points.push_back({to_float3(point_at(corners, place)), to_float3(share)});
    }
    before = end;
  }
  return points;
}

}  // namespace

std::vector<EmitterPoints> spread_over_emitters(const TransferData& data, int most_each, int most) {
  // Of each patch that emits. Copies in the same place have no patch, and count once so.
  std::map<std::uint32_t, std::vector<std::uint32_t>> triangles;
  for (std::uint32_t t = 0; t < data.mesh.triangle_patch.size(); ++t) {
    const std::uint32_t patch = data.mesh.triangle_patch[t];
    if (patch != kNone && emits(data.patches, patch)) triangles[patch].push_back(t);
  }
  if (triangles.empty()) return {};
  const int count = std::clamp(most / static_cast<int>(triangles.size()), 1, most_each);
  std::vector<EmitterPoints> emitters;
  for (const auto& [patch, of_patch] : triangles) {
    emitters.push_back({patch, spread(data.mesh, of_patch, count)});
  }
  return emitters;
}

}  // namespace rebounce
