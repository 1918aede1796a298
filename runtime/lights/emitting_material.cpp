#include "runtime/lights/emitting_material.h"

#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

float area_of(const DisplayMesh& mesh, std::size_t t) {
  const glm::vec3 a = to_glm(mesh.position[mesh.triangle[t][0]]);
  const glm::vec3 ab = to_glm(mesh.position[mesh.triangle[t][1]]) - a;
  const glm::vec3 ac = to_glm(mesh.position[mesh.triangle[t][2]]) - a;
  return 0.5F * glm::length(glm::cross(ab, ac));
}

}  // namespace

std::vector<std::uint32_t> find_emitting_material(const TransferData& data) {
  const DisplayMesh& mesh = data.mesh;
  std::vector<std::uint32_t> material(data.patches.size(), kNone);
  std::vector<float> most(material.size(), 0.0F), covered(material.size());
  for (std::uint32_t m = 0; m < data.materials.size(); ++m) {
    if (data.materials[m].emitted_luminance == Float3{0, 0, 0}) continue;
    covered.assign(covered.size(), 0.0F);
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
      const std::uint32_t patch = mesh.triangle_patch[t];
      if (patch != kNone && mesh.triangle_material[t] == m) covered[patch] += area_of(mesh, t);
    }
    for (std::size_t i = 0; i < covered.size(); ++i) {
      if (covered[i] <= most[i]) continue;
      most[i] = covered[i];
      material[i] = m;
    }
  }
  return material;
}

}  // namespace rebounce
