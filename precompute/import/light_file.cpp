#include "precompute/import/light_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "precompute/import/file_extension.h"
#include "precompute/import/import_gltf.h"
#include "precompute/import/json_fields.h"
#include "rebounce/error.h"
#include "rebounce/lights.h"
#include "rebounce/sky.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

using nlohmann::json;

constexpr std::size_t kLargestProfileBytes = std::size_t{16} << 20U;

/// Joins `words` as in "a, b and c".
template <typename Words>
std::string listed(const Words& words, const char* last) {
  std::string text;
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (k > 0) text += k + 1 < words.size() ? std::string(", ") : fmt::format(" {} ", last);
    text += words[k];
  }
  return text;
}

const LampKind& read_kind(const Field& field) {
  const json type = field.object.value("type", json("point"));
  std::vector<std::string> names;
  for (const LampKind* kind : lamp_kinds()) {
    if (type == kind->name) return *kind;
    names.push_back(fmt::format("\"{}\"", kind->name));
  }
  field.fail("type", listed(names, "or"));
}

/// The fields of all kinds in the order in which they are read: a profile comes last.
std::vector<const LampField*> all_fields() {
  std::vector<const LampField*> fields(kCommonFields.begin(), kCommonFields.end());
  for (const LampKind* kind : lamp_kinds()) {
    for (const LampField* field : kind->fields) {
      const bool known = std::ranges::find(fields, field) != fields.end();
      if (!known && field != &kProfile) fields.push_back(field);
    }
  }
  fields.push_back(&kProfile);
  return fields;
}

/// Throws Error if a light has a field that its kind does not use.
void refuse_other(const Field& light, const LampField& field) {
  std::vector<std::string> users;
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->uses(field)) users.emplace_back(kind->plural);
  }
  if (&field == &kTangent) users.emplace_back("lights with \"ies\"");
  for (std::size_t k = 0; k < field.json_count(); ++k) {
    if (!light.object.contains(field.json[k])) continue;
    throw Error(
        fmt::format("{}: \"{}\" is for {} only", light.where, field.json[k], listed(users, "and")));
  }
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

/// The direction of the first side of a rectangle, from which the horizontal angles of a profile
/// count: by default x, or z if the light travels along x.
Float3 read_tangent(const Field& field, const Float3& direction) {
  const Float3 fallback = std::abs(direction[0]) < 0.9F ? Float3{1, 0, 0} : Float3{0, 0, 1};
  const Float3 t = field.triple("tangent", kAnyNumber, fallback);
  const glm::vec3 across = glm::cross(to_glm(direction), to_glm(t));
  if (!(glm::length(across) > 1e-3F * glm::length(to_glm(t)))) {
    field.fail("tangent", "a vector that does not lie along the direction");
  }
  return t;
}

/// The profile that the light names, relative to the light file.
std::shared_ptr<const IntensityProfile> read_profile(const Field& field,
                                                     const std::filesystem::path& folder) {
  const json& name = field.object.at("ies");
  if (!name.is_string()) field.fail("ies", "the name of an IES file");
  const std::filesystem::path path = folder / name.get<std::string>();
  std::error_code failure;
  std::ifstream stream;
  // Not a pipe, which would be waited for.
  if (std::filesystem::is_regular_file(path, failure)) stream.open(path, std::ios::binary);
  const std::uintmax_t size = std::filesystem::file_size(path, failure);
  if (failure || !stream.is_open()) {
    throw Error(fmt::format("{}: cannot open {}; check \"ies\"", field.where, path.string()));
  }
  if (size > kLargestProfileBytes) {
    throw Error(fmt::format("{}: {} is too large for an IES file", field.where, path.string()));
  }
  std::string text(size, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return parse_ies_profile(text, fmt::format("{}: {}", field.where, path.string()));
}

void read_field(const Field& field, const LampField& read, const std::filesystem::path& folder,
                Light& light) {
  const std::string name(read.json[0]);
  const std::span<float> values = read.values(light);
  const auto vector = [&] { return Float3{values[0], values[1], values[2]}; };
  switch (read.rule) {
    case FieldRule::kFinite:
      std::ranges::copy(field.triple(name, kAnyNumber, vector()), values.begin());
      break;
    case FieldRule::kNotNegative:
      if (values.size() == 1) {
        values[0] = field.number(name, 0, values[0]);
      } else {
        std::ranges::copy(field.triple(name, 0, vector()), values.begin());
      }
      break;
    case FieldRule::kLength:
      for (std::size_t k = 0; k < values.size(); ++k) {
        values[k] = field.required_length(std::string(read.json[k]));
      }
      break;
    case FieldRule::kUnitVector:
      std::ranges::copy(field.unit_vector(name, vector()), values.begin());
      break;
    case FieldRule::kAcross:
      std::ranges::copy(read_tangent(field, light.direction), values.begin());
      break;
    case FieldRule::kCone:
      read_cone(field, light);
      break;
    case FieldRule::kProfile:
      if (field.object.contains(name)) light.profile = read_profile(field, folder);
      break;
  }
}

Light read_light(const Field& field, const std::filesystem::path& folder) {
  if (!field.object.is_object()) throw Error(field.where + ": must be an object");
  const std::vector<const LampField*> fields = all_fields();
  std::vector<std::string_view> names = {"type", "name"};
  for (const LampField* known : fields) {
    names.insert(names.end(), known->json.begin(), known->json.begin() + known->json_count());
  }
  field.check_names(names);
  const LampKind& kind = read_kind(field);
  Light light;
  light.type = kind.type;
  if (field.object.contains("name")) {
    if (!field.object.at("name").is_string()) field.fail("name", "a string");
    light.name = field.object.at("name").get<std::string>();
  }
  const bool profiled = field.object.contains("ies");
  for (const LampField* known : fields) {
    if (known->is_common || kind.uses(*known) || (known == &kTangent && profiled)) {
      read_field(field, *known, folder, light);
    } else {
      refuse_other(field, *known);
    }
  }
  return light;
}

std::vector<EmitterScale> read_emitters(const Field& root) {
  std::vector<EmitterScale> emitters;
  if (!root.object.contains("emitters")) return emitters;
  const json& list = root.object.at("emitters");
  if (!list.is_array()) root.fail("emitters", "an array");
  for (std::size_t k = 0; k < list.size(); ++k) {
    const Field field{list[k], fmt::format("{}: emitter {}", root.where, k)};
    if (!field.object.is_object()) throw Error(field.where + ": must be an object");
    field.check_names({"material", "color", "scale"});
    const json material = field.object.value("material", json());
    if (!material.is_string()) field.fail("material", "the name of a material of the scene");
    EmitterScale emitter{material.get<std::string>(), field.triple("color", 0, {1, 1, 1})};
    for (float& x : emitter.scale) {
      x *= field.number("scale", 0, 1);
      if (std::isinf(x)) field.fail("scale", "finite when \"color\" is multiplied by it");
    }
    emitters.push_back(emitter);
  }
  return emitters;
}

SkyDistribution read_cie_sky(const Field& field) {
  const float type = field.number("cie", 1, 1);
  if (type != std::floor(type) || type > kCieSkyCount) field.fail("cie", "a whole number, 1 to 15");
  const float ground = field.number("groundReflectance", 0, 0.2F);
  const Float3 sun = field.vector("sunDirection", {0, -1, 0});
  try {
    return cie_sky(static_cast<int>(type), sun, ground);
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", field.where, error.what()));
  }
}

SkyDistribution read_sky_cells(const Field& field) {
  const json& cells = field.object.at("cells");
  SkyDistribution distribution{};
  bool good = cells.is_array() && cells.size() == distribution.size();
  for (std::size_t k = 0; good && k < distribution.size(); ++k) {
    good = cells[k].is_number();
    if (good) distribution[k] = cells[k].get<float>();
    good = good && std::isfinite(distribution[k]) && distribution[k] >= 0;
  }
  if (!good) field.fail("cells", fmt::format("{} numbers, at least 0", kSkyCellCount));
  return distribution;
}

Sky read_sky(const Field& field) {
  field.check_names({"color", "luminance", "cie", "sunDirection", "groundReflectance", "cells"});
  Sky sky;
  sky.color = field.triple("color", 0, sky.color);
  sky.luminance = field.number("luminance", 0, sky.luminance);
  const bool cie = field.object.contains("cie"), cells = field.object.contains("cells");
  if (cie && cells) field.fail("cells", "left out where there is \"cie\"");
  for (const char* name : {"sunDirection", "groundReflectance"}) {
    if (field.object.contains(name) && !cie) field.fail(name, "given with \"cie\" only");
  }
  if (cie) sky.distribution = std::make_shared<const SkyDistribution>(read_cie_sky(field));
  if (cells) sky.distribution = std::make_shared<const SkyDistribution>(read_sky_cells(field));
  return sky;
}

LightSetup read_json(const std::filesystem::path& path) {
  const json document = read_json_object(path, "lights");
  const Field root{document, path.string()};
  root.check_names({"lights", "sky", "emitters"});
  LightSetup setup;
  if (document.contains("lights")) {
    const json& lights = document.at("lights");
    if (!lights.is_array()) root.fail("lights", "an array");
    for (std::size_t k = 0; k < lights.size(); ++k) {
      setup.lights.push_back(read_light({lights[k], fmt::format("{}: light {}", path.string(), k)},
                                        path.parent_path()));
    }
  }
  setup.emitters = read_emitters(root);
  if (document.contains("sky")) {
    if (!document.at("sky").is_object()) root.fail("sky", "an object");
    setup.sky = read_sky({document.at("sky"), path.string() + ": sky"});
  }
  return setup;
}

}  // namespace

LightSetup read_lights(const std::filesystem::path& path, double scale) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".glb" && extension != ".gltf") return read_json(path);
  LightSetup setup;
  setup.lights = import_gltf_lights(path, scale);
  if (setup.lights.empty()) throw Error(path.string() + " has no KHR_lights_punctual lights");
  return setup;
}

}  // namespace rebounce
