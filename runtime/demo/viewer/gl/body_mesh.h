#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "rebounce/lights.h"
#include "runtime/demo/viewer/gl/gpu_scene.h"

namespace rebounce {

/// A vertex of an object that is not part of the scene. Colour and light are linear; light is in
/// lx.
struct BodyVertex {
  Float3 position{}, normal{}, color{};
  Float3 first_flight{};  ///< sky and emitters
  std::array<Float3, kSideCount> bounced{};
};

/// The triangles of one body.
struct BodyPart {
  std::uint32_t begin = 0, end = 0;
  Float3 emitted_luminance{0, 0, 0};  ///< cd/m²
};

/// Lit spheres and the surfaces of lamps, as triangles.
struct BodyMesh {
  std::vector<BodyVertex> vertex;
  std::vector<Uint3> triangle;
  std::vector<BodyPart> part;
};

/// Unit normals of the vertices that add_sphere makes, in their order.
const std::vector<Float3>& sphere_normals();

/// Adds a sphere. `shade`(k) returns its vertex k; position and normal are filled in.
void add_sphere(const Float3& center, float radius,
                const std::function<BodyVertex(std::size_t k)>& shade, BodyMesh& mesh);

/// Adds the surface of `lamp` as an emitter; nothing if it has none.
void add_lamp_surface(const Light& lamp, BodyMesh& mesh);

}  // namespace rebounce
