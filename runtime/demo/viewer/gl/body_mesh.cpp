#include "runtime/demo/viewer/gl/body_mesh.h"

#include <span>

#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

/// Adds `triangles` over `vertices` new vertices of the mesh; the caller fills in the vertices.
BodyPart add_part(std::span<const Uint3> triangles, std::size_t vertices, BodyMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertex.size());
  BodyPart part{.begin = static_cast<std::uint32_t>(mesh.triangle.size())};
  for (const Uint3& t : triangles) {
    mesh.triangle.push_back({first + t[0], first + t[1], first + t[2]});
  }
  part.end = static_cast<std::uint32_t>(mesh.triangle.size());
  mesh.vertex.resize(first + vertices);
  return part;
}

}  // namespace

const std::vector<Float3>& sphere_normals() {
  return unit_sphere().normal;
}

void add_sphere(const Float3& center, float radius,
                const std::function<BodyVertex(std::size_t k)>& shade, BodyMesh& mesh) {
  const std::vector<Float3>& normals = sphere_normals();
  mesh.part.push_back(add_part(unit_sphere().triangle, normals.size(), mesh));
  for (std::size_t k = 0; k < normals.size(); ++k) {
    BodyVertex vertex = shade(k);
    vertex.position = to_float3(to_glm(center) + radius * to_glm(normals[k]));
    vertex.normal = normals[k];
    mesh.vertex[mesh.vertex.size() - normals.size() + k] = vertex;
  }
}

void add_lamp_surface(const Light& lamp, BodyMesh& mesh) {
  const LampSurface* const surface = lamp_kind(lamp.type).surface;
  if (surface == nullptr) return;
  const LampMesh made = surface->mesh(PreparedLight(lamp));
  const std::size_t count = made.position.size();
  BodyPart part = add_part(made.triangle, count, mesh);
  for (std::size_t k = 0; k < count; ++k) {
    BodyVertex& vertex = mesh.vertex[mesh.vertex.size() - count + k];
    vertex.position = made.position[k];
    vertex.normal = made.normal[k];
  }
  part.emitted_luminance = to_float3(lamp.intensity * to_glm(lamp.color));
  mesh.part.push_back(part);
}

}  // namespace rebounce
