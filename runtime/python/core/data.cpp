// Transfer data: files, arrays, and products with Y and F.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "rebounce/error.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/module.h"
#include "runtime/python/core/product.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::python {
namespace {

/// F of a file, in the form that gathers fastest.
class FormFactors {
 public:
  explicit FormFactors(const Data& data)
      : data_(data.transfer), factors_(make_form_factors(SolveMethod::kConjugateGradient, *data)) {}

  std::size_t size() const { return factors_->patch_count(); }

  /// F x for x [n][columns]; three columns share a pass.
  template <typename Number>
  void gather(const Number* in, Number* out, std::size_t columns, bool adjoint) const {
    const std::size_t n = size();
    std::vector<Float3> light(n), result(n);
    std::vector<float> workspace(factors_->workspace_size());
    const std::vector<float>& area = data_->patches.area;
    for (std::size_t begin = 0; begin < columns; begin += kChannelCount) {
      const std::size_t count = std::min<std::size_t>(kChannelCount, columns - begin);
      for (std::size_t i = 0; i < n; ++i) {
        const float scale = adjoint ? 1 / area[i] : 1;
        for (std::size_t k = 0; k < count; ++k) {
          light[i][k] = scale * static_cast<float>(in[i * columns + begin + k]);
        }
      }
      factors_->gather(light, result, workspace);
      for (std::size_t i = 0; i < n; ++i) {
        const float scale = adjoint ? area[i] : 1;
        for (std::size_t k = 0; k < count; ++k) {
          out[i * columns + begin + k] = static_cast<Number>(scale * result[i][k]);
        }
      }
    }
  }

 private:
  std::shared_ptr<const TransferData> data_;
  std::unique_ptr<const SweepableFormFactors> factors_;
};

template <typename Number>
py::array gather_with(const FormFactors& factors, const Array<Number>& light, bool adjoint) {
  check_shape(light, {static_cast<py::ssize_t>(factors.size()), -1}, "light");
  py::array_t<Number> result({light.shape(0), light.shape(1)});
  const Number* in = light.data();
  check_finite(std::span(in, static_cast<std::size_t>(light.size())), "light");
  Number* out = result.mutable_data();
  const auto columns = static_cast<std::size_t>(light.shape(1));
  const py::gil_scoped_release unlocked;
  factors.gather(in, out, columns, adjoint);
  return result;
}

/// The stored pairs as (indptr, indices, data) of the upper triangle of A F, m².
py::tuple exchange_of_pairs(const py::object& self) {
  const auto& data = self.cast<const Data&>();
  const ExchangeMatrix& exchange = data->exchange;
  if (exchange.empty()) {
    throw Error(
        "the transfer data have no form factors of pairs; precompute them with "
        "form_factors=\"exact\"");
  }
  const auto count = static_cast<py::ssize_t>(exchange.column.size());
  return py::make_tuple(view_of(exchange.row_begin.data(),
                                {static_cast<py::ssize_t>(exchange.row_begin.size())}, self),
                        view_of(exchange.column.data(), {count}, self),
                        view_of(exchange.exchange_area.data(), {count}, self));
}

py::dict patches_of_data(const py::object& self) {
  const PatchTable& p = self.cast<const Data&>()->patches;
  py::dict arrays;
  const auto add = [&](const char* name, const auto& values) {
    arrays[name] = view_of(std::span(values), self);
  };
  add("area", p.area);
  add("centroid", p.centroid);
  add("normal", p.normal);
  add("reflectance", p.reflectance);
  add("emitted_exitance", p.emitted_exitance);
  add("sky_visibility", p.sky_visibility);
  add("absorbed", p.absorbed);
  return arrays;
}

py::dict mesh_of_data(const py::object& self) {
  const DisplayMesh& mesh = self.cast<const Data&>()->mesh;
  py::dict arrays;
  arrays["position"] = view_of(std::span<const Float3>(mesh.position), self);
  arrays["triangle"] = view_of(mesh.triangle.empty() ? nullptr : mesh.triangle.front().data(),
                               {static_cast<py::ssize_t>(mesh.triangle.size()), 3}, self);
  arrays["triangle_patch"] = view_of(std::span<const std::uint32_t>(mesh.triangle_patch), self);
  arrays["triangle_material"] =
      view_of(std::span<const std::uint32_t>(mesh.triangle_material), self);
  arrays["surface_count"] = mesh.surface_count();
  return arrays;
}

py::dict record_of_data(const Data& data) {
  py::dict record;
  const BuildRecord& r = data->record;
  record["generator"] = r.generator;
  record["scene"] = r.scene_name;
  record["residual"] = r.solve_residual;
  record["tolerance"] = r.tolerance;
  record["error_mean"] = r.error_mean;
  record["error_max"] = r.error_max;
  record["error_bound"] = r.error_bound;
  record["operator"] = data->transfer ? operator_name(data->transfer->kind()) : "none";
  record["operator_bytes"] = data->transfer ? data->transfer->bytes() : 0;
  record["settings"] = data->settings_json;
  record["report"] = data->report_json;
  py::list materials;
  for (const Material& material : data->materials) materials.append(material.name);
  record["materials"] = materials;
  return record;
}

}  // namespace

void add_data(py::module_& module) {
  py::class_<Data>(module, "Data")
      .def_property_readonly("patch_count", [](const Data& d) { return d->patches.size(); })
      .def_property_readonly("has_form_factors", [](const Data& d) { return has_form_factors(*d); })
      .def_property_readonly("exchange_is_stored",
                             [](const Data& d) { return !d->exchange.empty(); })
      .def("patches", &patches_of_data)
      .def("mesh", &mesh_of_data)
      .def("record", &record_of_data)
      .def("exchange", &exchange_of_pairs)
      .def("apply", &apply_to_array, py::arg("light"), py::arg("adjoint"), py::arg("channel"));
  py::class_<FormFactors>(module, "FormFactors")
      .def(py::init<const Data&>(), py::call_guard<py::gil_scoped_release>())
      .def("gather", &gather_with<float>, py::arg("light").noconvert(), py::arg("adjoint"))
      .def("gather", &gather_with<double>, py::arg("light"), py::arg("adjoint"));
  module.def("load", [](const std::filesystem::path& path) {
    const py::gil_scoped_release unlocked;
    return Data{std::make_shared<const TransferData>(load_transfer_file(path))};
  });
  module.def("save", [](const std::filesystem::path& path, const Data& data) {
    const py::gil_scoped_release unlocked;
    save_transfer_file(path, *data);
  });
}

}  // namespace rebounce::python
