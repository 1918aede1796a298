#include "precompute/cli/light_path_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "precompute/import/json_fields.h"
#include "rebounce/error.h"

namespace rebounce::cli {
namespace {

using nlohmann::json;

float positive(const Field& field, const std::string& name, float fallback) {
  const float value = field.number(name, 0, fallback);
  if (!(value > 0)) field.fail(name, "above 0");
  return value;
}

LightMotion read_circle(const Field& field, const Light& light) {
  field.check_names({"center", "axis", "radius", "period"});
  LightMotion motion{.kind = LightMotion::Kind::kCircle};
  motion.center = field.triple("center", kAnyNumber, light.position);
  motion.axis = field.vector("axis", motion.axis);
  motion.radius = field.number("radius", 0, motion.radius);
  motion.period = positive(field, "period", motion.period);
  return motion;
}

LightMotion read_swing(const Field& field, const Light& light) {
  field.check_names({"from", "to", "period"});
  LightMotion motion{.kind = LightMotion::Kind::kSwing};
  motion.from = field.triple("from", kAnyNumber, light.position);
  motion.to = field.triple("to", kAnyNumber, light.position);
  motion.period = positive(field, "period", motion.period);
  return motion;
}

LightMotion read_keys(const json& keys, const Field& parent, const Light& light) {
  if (!keys.is_array() || keys.empty()) parent.fail("keys", "an array of keys, at least one");
  LightMotion motion{.kind = LightMotion::Kind::kKeys};
  LightMotion::Key key{.position = light.position,
                       .direction = light.direction,
                       .color = light.color,
                       .intensity = light.intensity};
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const Field field{keys[k], fmt::format("{}.keys: key {}", parent.where, k)};
    if (!keys[k].is_object()) throw Error(field.where + ": must be an object");
    field.check_names({"time", "position", "direction", "color", "intensity"});
    // Values that a key does not name stay as they were in the key before.
    key.time = field.number("time", key.time, key.time);
    key.position = field.triple("position", kAnyNumber, key.position);
    key.direction = field.unit_vector("direction", key.direction);
    key.color = field.triple("color", 0, key.color);
    key.intensity = field.number("intensity", 0, key.intensity);
    motion.keys.push_back(key);
  }
  return motion;
}

Field part_of(const Field& motion, const std::string& name) {
  const json& part = motion.object.at(name);
  if (!part.is_object()) motion.fail(name, "an object");
  return {part, motion.where + "." + name};
}

/// The motion that `field` describes, of an object that is like `light` at rest; empty if there is
/// none.
std::optional<LightMotion> read_motion(const Field& field, const Light& light) {
  const auto kinds =
      field.object.count("circle") + field.object.count("swing") + field.object.count("keys");
  if (kinds == 0) return std::nullopt;
  if (kinds > 1) {
    throw Error(field.where + ": must have one of \"circle\", \"swing\" and \"keys\"");
  }
  if (field.object.contains("circle")) return read_circle(part_of(field, "circle"), light);
  if (field.object.contains("swing")) return read_swing(part_of(field, "swing"), light);
  return read_keys(field.object.at("keys"), field, light);
}

ViewerSphere read_sphere(const Field& field) {
  field.check_names({"position", "radius", "color", "circle", "swing", "keys"});
  ViewerSphere sphere;
  sphere.position = field.triple("position", kAnyNumber, sphere.position);
  sphere.radius = field.required_length("radius");
  sphere.reflectance = field.triple("color", 0, sphere.reflectance);
  Light at_rest;
  at_rest.position = sphere.position;
  if (const auto motion = read_motion(field, at_rest)) sphere.motion = *motion;
  return sphere;
}

ViewerLight& light_of(const Field& field, std::vector<ViewerLight>& lights) {
  const json number = field.object.value("light", json(0));
  const bool known = number.is_number_integer() && number.get<std::int64_t>() >= 0 &&
                     number.get<std::uint64_t>() < lights.size();
  if (!known) field.fail("light", fmt::format("the number of a light, below {}", lights.size()));
  return lights[number.get<std::size_t>()];
}

}  // namespace

float read_light_path(const std::filesystem::path& path, std::vector<ViewerLight>& lights,
                      std::vector<ViewerSphere>& spheres) {
  const json document = read_json_object(path, "motions");
  const Field root{document, path.string()};
  root.check_names({"frames_per_second", "motions", "spheres"});
  const auto for_each = [&](const char* name, const char* item, const auto& take) {
    const json list = document.value(name, json::array());
    if (!list.is_array()) root.fail(name, "an array");
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Field field{list[k], fmt::format("{}: {} {}", path.string(), item, k)};
      if (!list[k].is_object()) throw Error(field.where + ": must be an object");
      take(field);
    }
  };
  for_each("motions", "motion", [&](const Field& field) {
    field.check_names({"light", "circle", "swing", "keys"});
    ViewerLight& lamp = light_of(field, lights);
    const auto motion = read_motion(field, lamp.light);
    if (!motion) {
      throw Error(field.where + ": must have one of \"circle\", \"swing\" and \"keys\"");
    }
    lamp.motion = *motion;
  });
  for_each("spheres", "sphere", [&](const Field& field) { spheres.push_back(read_sphere(field)); });
  return positive(root, "frames_per_second", 30);
}

}  // namespace rebounce::cli
