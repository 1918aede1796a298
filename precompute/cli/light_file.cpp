#include "light_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "json_fields.h"
#include "rebounce/precompute/import_gltf.h"
#include "rebounce/transfer/error.h"

namespace rebounce::cli {
namespace {

using nlohmann::json;

LightType light_type(const Field& field) {
  const json type = field.object.value("type", json("point"));
  if (type == "point") return LightType::kPoint;
  if (type == "spot") return LightType::kSpot;
  if (type == "directional") return LightType::kDirectional;
  field.fail("type", "\"point\", \"spot\" or \"directional\"");
}

void read_cone(const Field& light_field, Light& light) {
  if (!light_field.object.contains("spot")) return;
  const json& spot = light_field.object.at("spot");
  if (!spot.is_object()) light_field.fail("spot", "an object with cone angles");
  const Field field{spot, light_field.where + ".spot"};
  field.check_names({"innerConeAngle", "outerConeAngle"});
  light.inner_cone_angle = field.number("innerConeAngle", 0, light.inner_cone_angle);
  light.outer_cone_angle = field.number("outerConeAngle", 0, light.outer_cone_angle);
  if (light.outer_cone_angle > std::numbers::pi_v<float> / 2) {
    field.fail("outerConeAngle", "at most pi / 2");
  }
  if (light.inner_cone_angle >= light.outer_cone_angle) {
    field.fail("innerConeAngle", "less than outerConeAngle");
  }
}

Light read_light(const Field& field) {
  if (!field.object.is_object()) throw Error(field.where + ": must be an object");
  field.check_names(
      {"type", "name", "position", "direction", "color", "intensity", "range", "spot"});
  Light light;
  light.type = light_type(field);
  if (field.object.contains("name")) {
    if (!field.object.at("name").is_string()) field.fail("name", "a string");
    light.name = field.object.at("name").get<std::string>();
  }
  light.position = field.triple("position", kAnyNumber, light.position);
  light.direction = field.unit_vector("direction", light.direction);
  light.color = field.triple("color", 0, light.color);
  light.intensity = field.number("intensity", 0, light.intensity);
  light.range = field.number("range", 0, light.range);
  read_cone(field, light);
  return light;
}

LightSetup read_json(const std::filesystem::path& path) {
  const json document = read_json_object(path, "lights");
  const Field root{document, path.string()};
  root.check_names({"lights", "sky"});
  LightSetup setup;
  if (document.contains("lights")) {
    const json& lights = document.at("lights");
    if (!lights.is_array()) root.fail("lights", "an array");
    for (std::size_t k = 0; k < lights.size(); ++k) {
      setup.lights.push_back(
          read_light({lights[k], fmt::format("{}: light {}", path.string(), k)}));
    }
  }
  if (document.contains("sky")) {
    if (!document.at("sky").is_object()) root.fail("sky", "an object");
    const Field field{document.at("sky"), path.string() + ": sky"};
    field.check_names({"color", "luminance"});
    setup.sky.color = field.triple("color", 0, setup.sky.color);
    setup.sky.luminance = field.number("luminance", 0, setup.sky.luminance);
  }
  return setup;
}

}  // namespace

LightSetup read_lights(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".glb" && extension != ".gltf") return read_json(path);
  LightSetup setup;
  setup.lights = import_gltf(path).lights;
  if (setup.lights.empty()) throw Error(path.string() + " has no KHR_lights_punctual lights");
  return setup;
}

LightSetup choose_lights(const std::filesystem::path& path, const TransferData& data) {
  LightSetup setup;
  if (path.empty()) {
    setup.lights = data.lights;
  } else {
    setup = read_lights(path);
  }
  const bool emits = std::ranges::any_of(data.patches.emitted_exitance, [](const Float3& m) {
    return m[0] > 0 || m[1] > 0 || m[2] > 0;
  });
  if (setup.lights.empty() && setup.sky.luminance == 0 && !emits) {
    throw Error("there is no light: the scene has none of its own; give some with --lights");
  }
  return setup;
}

}  // namespace rebounce::cli
