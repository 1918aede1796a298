#include "rebounce/precompute/reconstruction_weights.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "rebounce/precompute/subdivision.h"
#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kMostlyCovered = 0.9F;   // what little is left of such a patch is too noisy to show
constexpr double kCreaseCosine = 0.766;  // 40 degrees: rounder is meant to look smooth

/// One corner of a display triangle, as seen from the place where it is.
struct Corner {
  std::uint32_t patch;
  glm::vec3 normal;
  float angle;
};

glm::dvec3 area_vector(const DisplayMesh& mesh, const Uint3& t) {
  const glm::dvec3 a = to_dvec3(mesh.position[t[0]]);
  return glm::cross(to_dvec3(mesh.position[t[1]]) - a, to_dvec3(mesh.position[t[2]]) - a);
}

double corner_angle(const DisplayMesh& mesh, const Uint3& t, int corner) {
  const glm::dvec3 at = to_dvec3(mesh.position[t[corner]]);
  const glm::dvec3 u = to_dvec3(mesh.position[t[(corner + 1) % 3]]) - at;
  const glm::dvec3 v = to_dvec3(mesh.position[t[(corner + 2) % 3]]) - at;
  return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
}

}  // namespace

void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, DisplayMesh& mesh) {
  const WeldedPositions welded = weld_positions(mesh.position);
  std::vector<std::vector<Corner>> corners_at(welded.count);
  std::vector<glm::dvec3> vertex_normal(mesh.position.size(), glm::dvec3(0));
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const glm::dvec3 area = area_vector(mesh, mesh.triangle[t]);
    const glm::vec3 normal(glm::normalize(area));
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t v = mesh.triangle[t][corner];
      vertex_normal[v] += area;
      const std::uint32_t patch = shown_patch[t];
      if (patch == kNone || absorbed[patch] > kMostlyCovered) continue;
      const auto angle = static_cast<float>(corner_angle(mesh, mesh.triangle[t], corner));
      corners_at[welded.id[v]].push_back({patch, normal, angle});
    }
  }

  mesh.weight_begin.assign(1, 0);
  mesh.weight_patch.clear();
  mesh.weight.clear();
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const glm::dvec3 normal = vertex_normal[v] / std::max(glm::length(vertex_normal[v]), 1e-300);
    std::map<std::uint32_t, double> weight_of;
    double sum = 0;
    for (const Corner& corner : corners_at[welded.id[v]]) {
      if (glm::dot(normal, glm::dvec3(corner.normal)) < kCreaseCosine) continue;
      weight_of[corner.patch] += corner.angle;
      sum += corner.angle * (1.0 - absorbed[corner.patch]);
    }
    for (const auto& [patch, weight] : weight_of) {
      mesh.weight_patch.push_back(patch);
      mesh.weight.push_back(static_cast<float>(weight / sum));
    }
    mesh.weight_begin.push_back(static_cast<std::uint32_t>(mesh.weight.size()));
  }
}

}  // namespace rebounce
