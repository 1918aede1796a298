#include "runtime/python/core/lamps.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>

#include "precompute/import/light_file.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/module.h"

namespace rebounce::python {
namespace {

LightType type_named(const std::string& name) {
  std::string known_names;
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->name == name) return kind->type;
    known_names += (known_names.empty() ? "" : ", ") + std::string(kind->name);
  }
  throw py::value_error("type must be one of " + known_names + ", not \"" + name + "\"");
}

/// What a field must be, in words.
template <typename Value>
constexpr std::string_view kWanted = "a number";
template <>
constexpr std::string_view kWanted<std::string> = "a string";
template <>
constexpr std::string_view kWanted<Float2> = "two numbers";
template <>
constexpr std::string_view kWanted<Float3> = "three numbers";
template <>
constexpr std::string_view kWanted<std::shared_ptr<IntensityProfile>> =
    "None or what load_profile returns";

/// A field of a Light or a Sky. Throws ValueError if it is no `Value`.
template <typename Value>
Value field(const py::handle& fields, const char* name) {
  const py::object given = fields.attr(name);
  try {
    return given.cast<Value>();
  } catch (const py::cast_error&) {
    throw py::value_error(std::string(name) + " must be " + std::string(kWanted<Value>) + ", not " +
                          py::repr(given).cast<std::string>());
  }
}

Light light_from(const py::handle& fields) {
  Light light;
  light.type = type_named(field<std::string>(fields, "type"));
  light.name = field<std::string>(fields, "name");
  light.position = field<Float3>(fields, "position");
  light.direction = field<Float3>(fields, "direction");
  light.color = field<Float3>(fields, "color");
  light.intensity = field<float>(fields, "intensity");
  light.range = field<float>(fields, "range");
  light.inner_cone_angle = field<float>(fields, "inner_cone_angle");
  light.outer_cone_angle = field<float>(fields, "outer_cone_angle");
  light.radius = field<float>(fields, "radius");
  light.size = field<Float2>(fields, "size");
  light.tangent = field<Float3>(fields, "tangent");
  light.profile = field<std::shared_ptr<IntensityProfile>>(fields, "profile");
  return light;
}

py::tuple read_light_file(const std::filesystem::path& path, double scale) {
  const LightSetup setup = read_lights(path, scale);
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
  module.def("read_lights", &read_light_file, py::arg("path"), py::arg("scale"));
}

std::vector<Light> lights_from(const py::sequence& lights) {
  std::vector<Light> result;
  for (const py::handle& fields : lights) {
    try {
      result.push_back(light_from(fields));
    } catch (const py::value_error& error) {
      throw py::value_error("light " + std::to_string(result.size()) + ": " + error.what());
    }
  }
  return result;
}

py::list lights_of(std::span<const Light> lights) {
  py::list result;
  for (const Light& light : lights) {
    py::dict fields;
    fields["type"] = std::string(lamp_kind(light.type).name);
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
  result.color = field<Float3>(sky, "color");
  result.luminance = field<float>(sky, "luminance");
  const py::object cells = sky.attr("distribution");
  if (cells.is_none()) return result;
  const auto array = Array<float>::ensure(cells);
  if (!array) throw py::value_error("the distribution of a sky must be 146 numbers");
  check_shape(array, {kSkyCellCount}, "the distribution of a sky");
  SkyDistribution distribution;
  std::copy_n(array.data(), kSkyCellCount, distribution.begin());
  result.distribution = std::make_shared<const SkyDistribution>(distribution);
  return result;
}

}  // namespace rebounce::python
