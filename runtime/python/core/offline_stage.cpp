// The offline stage, on a file or on arrays.

#include "precompute/build/transfer_build.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <cmath>
#include <span>
#include <string>

#include "precompute/patches/winding.h"
#include "rebounce/error.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/lamps.h"
#include "runtime/python/core/long_work.h"
#include "runtime/python/core/module.h"
#include "transfer/file/content_hash.h"

namespace rebounce::python {
namespace {

/// Of the arrays of a scene, as files have it of theirs.
std::string hash_of(const Scene& scene, const Array<float>& reflectance,
                    const Array<float>& emission, bool double_sided) {
  ContentHash hash;
  hash.update(std::as_bytes(std::span(scene.position)));
  hash.update(std::as_bytes(std::span(scene.triangle)));
  hash.update(std::as_bytes(std::span(scene.triangle_material)));
  for (const auto* array : {&reflectance, &emission}) {
    hash.update(std::as_bytes(std::span(array->data(), static_cast<std::size_t>(array->size()))));
  }
  hash.update(std::as_bytes(std::span(&double_sided, 1)));
  return hash.text();
}

/// A scene of triangles [t] whose numbers are in order (the package looks): material k is the k-th
/// different group of `group` [t], with the reflectance and emitted luminance of its rows.
Scene make_scene(const Array<float>& vertices, const Array<std::uint32_t>& triangles,
                 const Array<std::uint32_t>& group, const Array<float>& reflectance,
                 const Array<float>& emission, bool double_sided, const std::string& name) {
  check_shape(vertices, {-1, 3}, "vertices");
  check_shape(triangles, {-1, 3}, "triangles");
  check_shape(group, {triangles.shape(0)}, "group");
  check_shape(reflectance, {-1, 3}, "reflectance");
  check_shape(emission, {reflectance.shape(0), 3}, "emission");
  Scene scene;
  scene.name = name;
  const std::span<const Float3> corners = rows_of(vertices);
  const std::uint32_t* index = triangles.data();
  // Shading normals are those of the triangles, so each has vertices of its own.
  for (py::ssize_t t = 0; t < triangles.shape(0); ++t) {
    std::array<Float3, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = corners[index[3 * t + static_cast<py::ssize_t>(k)]];
    const auto edge = [&](std::size_t k, std::size_t axis) { return p[k][axis] - p[0][axis]; };
    Float3 normal{edge(1, 1) * edge(2, 2) - edge(1, 2) * edge(2, 1),
                  edge(1, 2) * edge(2, 0) - edge(1, 0) * edge(2, 2),
                  edge(1, 0) * edge(2, 1) - edge(1, 1) * edge(2, 0)};
    const float length = std::hypot(normal[0], normal[1], normal[2]);
    if (!(length > 0)) {
      ++scene.degenerate_triangle_count;
      continue;
    }
    for (float& axis : normal) axis /= length;
    const auto first = static_cast<std::uint32_t>(scene.position.size());
    scene.position.insert(scene.position.end(), p.begin(), p.end());
    scene.normal.insert(scene.normal.end(), 3, normal);
    scene.triangle.push_back({first, first + 1, first + 2});
    scene.triangle_material.push_back(group.data()[t]);
  }
  scene.base_color_texcoord.resize(scene.position.size(), Float2{0, 0});
  scene.emissive_texcoord.resize(scene.position.size(), Float2{0, 0});
  scene.vertex_color.resize(scene.position.size(), Float3{1, 1, 1});
  for (py::ssize_t k = 0; k < reflectance.shape(0); ++k) {
    Material material;
    material.name = std::to_string(k);
    material.base_color = rows_of(reflectance)[static_cast<std::size_t>(k)];
    material.emitted_luminance = rows_of(emission)[static_cast<std::size_t>(k)];
    material.double_sided = double_sided;
    scene.materials.push_back(std::move(material));
  }
  scene.hash = hash_of(scene, reflectance, emission, double_sided);
  return scene;
}

BuildSettings settings_of(const py::dict& options) {
  BuildSettings settings;
  for (const auto& [key, value] : options) {
    const auto name = key.cast<std::string>();
    if (name == "patches") settings.subdivision.patch_count = value.cast<std::size_t>();
    if (name == "patch_size") {
      settings.subdivision = {.patch_count = 0, .patch_size = value.cast<float>()};
    }
    if (name == "lights") settings.lights = lights_from(value.cast<py::sequence>());
    if (name == "tolerance") settings.tolerance = value.cast<double>();
    if (name == "seed") settings.form_factors.seed = value.cast<std::uint64_t>();
    if (name == "operator") settings.operator_kind = operator_kind(value.cast<std::string>());
    if (name == "store_form_factors") settings.store_form_factors = value.cast<bool>();
    if (name == "store_links") settings.store_links = value.cast<bool>();
    if (name == "form_factor_tolerance") settings.form_factor_tolerance = value.cast<double>();
    if (name == "quality") {
      settings.form_factors =
          with_quality(quality_named(value.cast<std::string>()), settings.form_factors);
    }
  }
  return settings;
}

py::dict arrays_of_scene(const py::object& self) {
  const auto& scene = self.cast<const Scene&>();
  py::dict arrays;
  arrays["vertices"] = view_of(std::span<const Float3>(scene.position), self);
  arrays["triangles"] = view_of(scene.triangle.empty() ? nullptr : scene.triangle.front().data(),
                                {static_cast<py::ssize_t>(scene.triangle.size()), 3}, self);
  return arrays;
}

/// Runs the offline stage. Returns the data and the warnings.
py::tuple build(const Scene& scene, const py::dict& options, const py::object& progress) {
  BuildSettings settings = settings_of(options);
  settings.scale = scene.scale;
  BuildReport report;
  LongWork work(progress);
  auto data = work.run([&] {
    return std::make_shared<const TransferData>(build_transfer_data(
        scene, settings, report,
        [&](std::string_view phase, double done) { return work.report(phase, done); }));
  });
  return py::make_tuple(Data{std::move(data)}, report.warnings);
}

}  // namespace

void add_build(py::module_& module) {
  py::class_<Scene>(module, "Scene")
      .def(py::init(&make_scene), py::arg("vertices"), py::arg("triangles"), py::arg("group"),
           py::arg("reflectance"), py::arg("emission"), py::arg("double_sided"), py::arg("name"))
      .def_readonly("name", &Scene::name)
      .def_readonly("warnings", &Scene::warnings)
      .def_property_readonly("lights", [](const Scene& scene) { return lights_of(scene.lights); })
      .def("arrays", &arrays_of_scene);
  module.def("load_scene", [](const std::filesystem::path& path, double scale) {
    const py::gil_scoped_release unlocked;
    return import_usable(path, scale);
  });
  module.def("build", &build, py::arg("scene"), py::arg("options"), py::arg("progress"));
}

}  // namespace rebounce::python
