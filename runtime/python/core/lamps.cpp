#include "runtime/python/core/lamps.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "precompute/import/light_file.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/module.h"

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
  const py::object profile = fields.attr("profile");
  if (!profile.is_none()) light.profile = profile.cast<std::shared_ptr<IntensityProfile>>();
  return light;
}

py::tuple read_light_file(const std::filesystem::path& path) {
  const LightSetup setup = read_lights(path);
  py::dict emitters;
  for (const EmitterScale& emitter : setup.emitters) {
    emitters[py::str(emitter.material)] = emitter.scale;
  }
  py::object cells = py::none();
  if (setup.sky.distribution) {
    cells = array_of(
        std::vector<float>(setup.sky.distribution->begin(), setup.sky.distribution->end()));
  }
  return py::make_tuple(lights_of(setup.lights), setup.sky.luminance, setup.sky.color, cells,
                        emitters);
}

std::shared_ptr<IntensityProfile> parse_profile(const std::string& text, const std::string& name) {
  return std::const_pointer_cast<IntensityProfile>(parse_ies_profile(text, name));
}

}  // namespace

void add_lamps(py::module_& module) {
  using Profile = IntensityProfile;
  const auto view = [](std::vector<float> Profile::*angles) {
    return [angles](const py::object& self) {
      return view_of(std::span<const float>(self.cast<const Profile&>().*angles), self);
    };
  };
  py::class_<Profile, std::shared_ptr<Profile>>(module, "Profile")
      .def_property_readonly("vertical", view(&Profile::vertical))
      .def_property_readonly("horizontal", view(&Profile::horizontal))
      .def("intensity", &Profile::intensity, py::arg("vertical_angle"),
           py::arg("horizontal_angle") = 0.0F);
  module.def("parse_profile", &parse_profile, py::arg("text"), py::arg("name"));
  module.def("read_lights", &read_light_file, py::arg("path"));
}

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
    fields["profile"] = std::const_pointer_cast<IntensityProfile>(light.profile);
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
