#include "precompute/import/gltf_lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>

#include "runtime/rays/float3_glm.h"

namespace rebounce::gltf {
namespace {

bool is_finite(const Float3& v) {
  return std::all_of(v.begin(), v.end(), [](float value) { return std::isfinite(value); });
}

// The unit vector along `v`; empty if it has no direction.
std::optional<glm::dvec3> direction_of(const glm::dvec3& v) {
  const double length = glm::length(v);
  if (!std::isfinite(length) || length == 0) return {};
  return v / length;
}

std::optional<LightType> light_type(const std::string& name) {
  if (name == "point") return LightType::kPoint;
  if (name == "spot") return LightType::kSpot;
  if (name == "directional") return LightType::kDirectional;
  return {};
}

// KHR_lights_punctual: 0 <= inner < outer <= pi/2.
void read_cone(const tinygltf::SpotLight& source, Light& light) {
  const double outer = std::clamp(source.outerConeAngle, 0.0, std::numbers::pi / 2);
  light.outer_cone_angle = static_cast<float>(outer);
  light.inner_cone_angle = static_cast<float>(std::clamp(source.innerConeAngle, 0.0, outer));
}

// The light in the world; empty, with the reason, if it cannot be used.
std::optional<Light> place_light(const tinygltf::Light& source, const tinygltf::Node& node,
                                 const glm::dmat4& world, double scale, std::string& problem) {
  const auto type = light_type(source.type);
  if (!type) {
    problem = fmt::format("its type \"{}\" is unknown", source.type);
    return {};
  }
  Light light;
  light.type = *type;
  light.name = source.name.empty() ? node.name : source.name;
  light.position = to_float3(glm::dvec3(world[3]));
  if (source.color.size() == light.color.size()) {
    light.color = to_float3(glm::dvec3(source.color[0], source.color[1], source.color[2]));
  }
  light.intensity = static_cast<float>(source.intensity);
  light.range = static_cast<float>(std::max(source.range, 0.0) * scale);
  if (*type == LightType::kSpot) read_cone(source.spot, light);

  const auto direction = direction_of(-glm::dvec3(world[2]));
  if (direction) light.direction = to_float3(*direction);
  const bool dark = std::any_of(light.color.begin(), light.color.end(),
                                [](float channel) { return channel < 0; });
  Float3 strongest = light.color;
  for (float& channel : strongest) channel *= light.intensity;
  if (dark || !(light.intensity >= 0) || !std::isfinite(light.intensity) ||
      !is_finite(light.color) || !is_finite(strongest)) {
    problem = "its colour times its intensity is negative or not finite";
  } else if (!is_finite(light.position) || !std::isfinite(light.range)) {
    problem = "its position or range is not finite";
  } else if (!direction && *type != LightType::kPoint) {
    problem = "its node has no direction";
  }
  return problem.empty() ? std::optional(light) : std::nullopt;
}

// The camera in the world, looking along the -z axis of the node with its +y axis upwards; empty,
// with the reason, if it cannot be used.
std::optional<Camera> place_camera(const tinygltf::Camera& source, const tinygltf::Node& node,
                                   const glm::dmat4& world, std::string& problem) {
  if (source.type != "perspective") {
    problem = "only perspective cameras are supported";
    return {};
  }
  const double fov = source.perspective.yfov;
  if (!(fov > 0 && fov < std::numbers::pi)) {
    problem = fmt::format("its yfov {} is not between 0 and pi", fov);
    return {};
  }
  const auto backward = direction_of(glm::dvec3(world[2]));
  const auto right =
      backward ? direction_of(glm::cross(glm::dvec3(world[1]), *backward)) : std::nullopt;
  Camera camera;
  camera.position = to_float3(glm::dvec3(world[3]));
  if (!right || !is_finite(camera.position)) {
    problem = "its node has no orientation or no finite position";
    return {};
  }
  camera.name = source.name.empty() ? node.name : source.name;
  camera.right = to_float3(*right);
  camera.up = to_float3(glm::cross(*backward, *right));
  camera.backward = to_float3(*backward);
  camera.vertical_fov = static_cast<float>(fov);
  return camera;
}

// The index of the light of the node, -1 if it has none.
int light_of(const tinygltf::Node& node) {
  const auto extension = node.extensions.find("KHR_lights_punctual");
  return extension == node.extensions.end() ? -1 : extension->second.Get("light").GetNumberAsInt();
}

}  // namespace

void import_lights_and_cameras(const Document& document, std::span<const PlacedNode> nodes,
                               double scale, Scene& scene, Warnings& warnings) {
  const tinygltf::Model& model = document.model;
  for (const PlacedNode& placed : nodes) {
    const tinygltf::Node& node = model.nodes[placed.node];
    if (const int index = light_of(node); index >= 0) {
      std::string problem;
      const auto light = place_light(model.lights.at(static_cast<std::size_t>(index)), node,
                                     placed.world, scale, problem);
      if (light) scene.lights.push_back(*light);
      if (!light) warnings.add(fmt::format("lights[{}] is left out: {}", index, problem));
    }
    if (node.camera >= 0) {
      std::string problem;
      const auto camera = place_camera(model.cameras.at(static_cast<std::size_t>(node.camera)),
                                       node, placed.world, problem);
      if (camera) scene.cameras.push_back(*camera);
      if (!camera) warnings.add(fmt::format("cameras[{}] is left out: {}", node.camera, problem));
    }
  }
}

}  // namespace rebounce::gltf
