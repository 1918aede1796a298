#include "runtime/lights/emitting_material.h"

#include <map>
#include <utility>

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
  if (data.materials.empty()) return material;  // data made in memory may have none
  std::map<std::pair<std::uint32_t, std::uint32_t>, float> covered;  // by patch and material
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const std::uint32_t patch = mesh.triangle_patch[t], m = mesh.triangle_material[t];
    if (patch == kNone || m >= data.materials.size()) continue;
    if (data.materials[m].emitted_luminance == Float3{0, 0, 0}) continue;
    covered[{patch, m}] += area_of(mesh, t);
  }
  std::vector<float> most(material.size(), 0.0F);
  for (const auto& [where, area] : covered) {
    const auto [patch, m] = where;
    if (area <= most[patch]) continue;
    most[patch] = area;
    material[patch] = m;
  }
  return material;
}

}  // namespace rebounce
