#include "runtime/lights/emitting_material.h"

#include <map>
#include <utility>

#include "runtime/rays/triangle.h"

namespace rebounce {
std::vector<std::uint32_t> find_emitting_material(const TransferData& data) {
  const DisplayMesh& mesh = data.mesh;
  std::vector<std::uint32_t> material(data.patches.size(), kNone);
  if (data.materials.empty()) return material;  // data made in memory may have none
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> covered;  // by patch and material
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const std::uint32_t patch = mesh.triangle_patch[t], m = mesh.triangle_material[t];
    if (patch == kNone || m >= data.materials.size()) continue;
    if (data.materials[m].emitted_luminance == Float3{0, 0, 0}) continue;
    covered[{patch, m}] += area_of(corners_of(mesh, t));
  }
  std::vector<double> most(material.size(), 0.0);
  for (const auto& [where, area] : covered) {
    const auto [patch, m] = where;
    if (area <= most[patch]) continue;
    most[patch] = area;
    material[patch] = m;
  }
  return material;
}

}  // namespace rebounce
