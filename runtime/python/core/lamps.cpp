#include "runtime/python/core/lamps.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "runtime/python/core/arrays.h"

namespace rebounce::python {
namespace {

// As in light files.
constexpr std::array<std::pair<std::string_view, LightType>, 6> kTypes = {{
    {"point", LightType::kPoint},
    {"spot", LightType::kSpot},
    {"directional", LightType::kDirectional},
    {"sphere", LightType::kSphere},
    {"rectangle", LightType::kRectangle},
    {"disc", LightType::kDisc},
}};

LightType type_named(const std::string& name) {
  for (const auto& [known, type] : kTypes) {
    if (known == name) return type;
  }
  throw py::value_error("there is no type \"" + name + "\" of lights");
}

Light light_from(const py::handle& fields) {
  Light light;
  light.type = type_named(fields.attr("type").cast<std::string>());
  light.name = fields.attr("name").cast<std::string>();
  light.position = fields.attr("position").cast<Float3>();
  light.direction = fields.attr("direction").cast<Float3>();
  light.color = fields.attr("color").cast<Float3>();
  light.intensity = fields.attr("intensity").cast<float>();
  light.range = fields.attr("range").cast<float>();
  light.inner_cone_angle = fields.attr("inner_cone_angle").cast<float>();
  light.outer_cone_angle = fields.attr("outer_cone_angle").cast<float>();
  light.radius = fields.attr("radius").cast<float>();
  light.size = fields.attr("size").cast<Float2>();
  light.tangent = fields.attr("tangent").cast<Float3>();
  return light;
}

}  // namespace

std::vector<Light> lights_from(const py::sequence& lights) {
  std::vector<Light> result;
  for (const py::handle& fields : lights) {
    try {
      result.push_back(light_from(fields));
    } catch (const py::cast_error&) {
      throw py::value_error("light " + std::to_string(result.size()) +
                            ": a field is no number, or has the wrong count of them");
    }
  }
  return result;
}

py::list lights_of(std::span<const Light> lights) {
  py::list result;
  for (const Light& light : lights) {
    py::dict fields;
    fields["type"] = std::string(std::ranges::find(kTypes, light.type, [](const auto& known) {
                                   return known.second;
                                 })->first);
    fields["name"] = light.name;
    fields["position"] = light.position;
    fields["direction"] = light.direction;
    fields["color"] = light.color;
    fields["intensity"] = light.intensity;
    fields["range"] = light.range;
    fields["inner_cone_angle"] = light.inner_cone_angle;
    fields["outer_cone_angle"] = light.outer_cone_angle;
    fields["radius"] = light.radius;
    fields["size"] = light.size;
    fields["tangent"] = light.tangent;
    result.append(fields);
  }
  return result;
}

Sky sky_from(const py::object& sky) {
  Sky result;
  if (sky.is_none()) return result;
  result.color = sky.attr("color").cast<Float3>();
  result.luminance = sky.attr("luminance").cast<float>();
  const py::object cells = sky.attr("distribution");
  if (cells.is_none()) return result;
  const auto array = Array<float>::ensure(cells);
  if (!array) throw py::value_error("the distribution of a sky is an array of numbers");
  check_shape(array, {kSkyCellCount}, "the distribution of a sky");
  SkyDistribution distribution;
  std::copy_n(array.data(), kSkyCellCount, distribution.begin());
  result.distribution = std::make_shared<const SkyDistribution>(distribution);
  return result;
}

}  // namespace rebounce::python
