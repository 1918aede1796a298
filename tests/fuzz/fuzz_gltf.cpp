// A scene: container, structure, buffers, Draco, meshopt, images, lights and cameras.

#include <algorithm>
#include <cmath>

#include "precompute/import/import_gltf.h"
#include "rebounce/error.h"
#include "tests/fuzz/fuzz_target.h"

namespace rebounce::fuzz {
namespace {

bool is_finite(const Float3& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

// What the stages behind the import rely on.
void check(const Scene& scene) {
  require(!scene.triangle.empty(), "a scene has triangles");
  require(scene.triangle_material.size() == scene.triangle.size(), "a material for each triangle");
  for (const Uint3& triangle : scene.triangle) {
    for (const std::uint32_t vertex : triangle) {
      require(vertex < scene.position.size(), "the vertices of a triangle are there");
    }
  }
  for (const std::uint32_t material : scene.triangle_material) {
    require(material < scene.materials.size(), "the material of a triangle is there");
  }
  require(std::ranges::all_of(scene.position, is_finite), "positions are finite");
  require(std::ranges::all_of(scene.lights,
                              [](const Light& light) {
                                return is_finite(light.position) && is_finite(light.direction) &&
                                       is_finite(light.color) && std::isfinite(light.intensity);
                              }),
          "lights are finite");
  for (const std::string& warning : scene.warnings) require_one_line(warning);
}

}  // namespace
}  // namespace rebounce::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace rebounce;
  static const fuzz::InputFolder folder;
  try {
    fuzz::check(import_gltf(folder.write("scene.glb", {data, size})));
  } catch (const Error& refusal) {
    fuzz::require_one_line(refusal.what());
  }
  return 0;
}
