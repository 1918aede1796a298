#include "rebounce/runtime/patch_points.h"

#include <algorithm>

#include "rebounce/runtime/cumulative_choice.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {

PatchTriangles::PatchTriangles(std::span<const std::uint32_t> triangle_patch,
                               std::size_t patch_count)
    : begin_(patch_count + 1, 0) {
  for (const std::uint32_t patch : triangle_patch) {
    if (patch != kNone) ++begin_[patch + 1];
  }
  for (std::size_t i = 0; i < patch_count; ++i) begin_[i + 1] += begin_[i];
  triangle_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t t = 0; t < triangle_patch.size(); ++t) {
    if (triangle_patch[t] != kNone) triangle_[next[triangle_patch[t]]++] = t;
  }
}

void spread_points(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                   const glm::dvec2& shift, std::span<PatchPoint> points) {
  const auto corner = [&](std::uint32_t t, int k) {
    return to_dvec3(mesh.position[mesh.triangle[t][k]]);
  };
  const auto cross = [&](std::uint32_t t) {
    return glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
  };
  CumulativeChoice choice;
  for (const std::uint32_t t : triangles) choice.add(glm::length(cross(t)));
  if (choice.total() <= 0) {
    std::ranges::fill(points, PatchPoint{});
    return;
  }
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    const glm::dvec2 square = r2_point(k, shift);
    const auto [index, rest] = choice.choose(square.x);
    const std::uint32_t t = triangles[index];
    const glm::dvec2 b = square_to_triangle({rest, square.y});
    const glm::dvec3 a = corner(t, 0);
    const glm::dvec3 position = a + b.x * (corner(t, 1) - a) + b.y * (corner(t, 2) - a);
    points[k] = {to_float3(position), to_float3(glm::normalize(cross(t)))};
  }
}

}  // namespace rebounce
