#include "precompute/import/import_gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <string>
#include <utility>

#include "precompute/import/gltf_document.h"
#include "precompute/import/gltf_lights.h"
#include "precompute/import/gltf_materials.h"
#include "precompute/import/gltf_meshes.h"
#include "precompute/import/gltf_nodes.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

// The default material is the last; primitives that name no material use it.
void drop_unused_default_material(Scene& scene) {
  const auto last = static_cast<std::uint32_t>(scene.materials.size() - 1);
  const auto& used = scene.triangle_material;
  if (last > 0 && std::find(used.begin(), used.end(), last) == used.end()) {
    scene.materials.pop_back();
  }
}

// A larger scene is probably not in metres but in millimetres or inches, a smaller one is a
// miniature.
constexpr float kLargestLikelySize = 500;
constexpr float kSmallestLikelySize = 0.2F;

// The longest side of the box around all vertices, in metres.
float largest_side(const Scene& scene) {
  Float3 low = scene.position.front();
  Float3 high = low;
  for (const Float3& position : scene.position) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], position[axis]);
      high[axis] = std::max(high[axis], position[axis]);
    }
  }
  return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
}

void warn_of_unlikely_size(const Scene& scene, gltf::Warnings& warnings) {
  const float size = largest_side(scene);
  if (size >= kSmallestLikelySize && size <= kLargestLikelySize) return;
  warnings.add(fmt::format("the scene is {} m wide; if it is not in metres use --scale",
                           size > 1 ? fmt::format("{:.0f}", size) : fmt::format("{:.3g}", size)));
}

Scene import_document(const gltf::Document& document, double scale, gltf::Warnings& warnings) {
  Scene scene;
  const auto nodes = gltf::place_nodes(document.model, scale);
  const auto texcoords = gltf::import_materials(document, scene, warnings);
  gltf::import_meshes(document, nodes, texcoords, scene, warnings);
  if (scene.triangle.empty()) {
    throw Error(scene.degenerate_triangle_count == 0
                    ? std::string("no triangles: the scene is empty")
                    : fmt::format("no triangles: all {} of them have no area",
                                  scene.degenerate_triangle_count));
  }
  gltf::import_lights_and_cameras(document, nodes, scale, scene, warnings);
  drop_unused_default_material(scene);
  warn_of_unlikely_size(scene, warnings);
  warnings.count("{} triangles without area were dropped", scene.degenerate_triangle_count);
  scene.warnings = warnings.lines();
  scene.hash = document.hash;
  return scene;
}

std::vector<Light> import_lights(const gltf::Document& document, double scale,
                                 gltf::Warnings& warnings) {
  Scene scene;
  const auto nodes = gltf::place_nodes(document.model, scale);
  gltf::import_lights_and_cameras(document, nodes, scale, scene, warnings);
  return std::move(scene.lights);
}

/// What `read`(document, scale, warnings) makes of a file. Errors name the file.
template <typename Read>
auto import_file(const std::filesystem::path& path, double scale, Read read) {
  if (!(scale > 0) || !std::isfinite(scale)) {
    throw Error(fmt::format("the scale {} is not a positive number", scale));
  }
  try {
    gltf::Warnings warnings;
    return read(gltf::read_document(path, warnings), scale, warnings);
  } catch (const std::bad_alloc&) {
    throw Error(fmt::format("{}: not enough memory to import it", path.string()));
  } catch (const std::exception& failure) {
    throw Error(fmt::format("{}: {}", path.string(), failure.what()));
  }
}

}  // namespace

Scene import_gltf(const std::filesystem::path& path, double scale) {
  Scene scene = import_file(path, scale, import_document);
  scene.name = path.filename().string();
  for (std::string& warning : scene.warnings) warning = one_line(warning);
  return scene;
}

std::vector<Light> import_gltf_lights(const std::filesystem::path& path, double scale) {
  return import_file(path, scale, import_lights);
}

}  // namespace rebounce
