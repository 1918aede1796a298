// Transfer data: files, arrays, and products with Y and F.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "rebounce/error.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/module.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::python {
namespace {

// Lights of one pass over the operator, and columns that are brought into the order of lights at a
// time: so many that a row of them fills cache lines.
constexpr std::size_t kPassLights = 4, kColumns = 16;

// Patches whose columns are turned at a time: what they read stays in the first cache.
constexpr std::size_t kTurnedPatches = 16;

/// Where the entries of a block [3 n][columns] lie.
struct BlockOrder {
  std::size_t row_stride, column_stride;
};

/// Calls move(place of an entry of the block, entry of light, patch) for every patch, channel and
/// one of `count` columns from `begin` on.
template <typename Move>
void turn(std::size_t n, const BlockOrder& order, std::size_t begin, std::size_t count,
          std::vector<Float3>& light, const Move& move) {
  for (std::size_t first = 0; first < n; first += kTurnedPatches) {
    const std::size_t end = std::min(n, first + kTurnedPatches);
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = first; i < end; ++i) {
        for (std::size_t c = 0; c < kChannelCount; ++c) {
          move((c * n + i) * order.row_stride + (begin + k) * order.column_stride,
               light[k * n + i][c], i);
        }
      }
    }
  }
}

/// Takes light [3 n][columns] in this order, channel by channel, through Y; the adjoint of Y is A Y
/// / A.
template <typename Number>
void apply(const TransferData& data, const Number* in, Number* out, std::size_t columns,
           const BlockOrder& order, bool adjoint, ProductScratch& scratch) {
  const TransferOperator& transfer = *data.transfer;
  const std::size_t n = transfer.patch_count();
  const std::size_t most = std::min(columns, order.row_stride == 1 ? kPassLights : kColumns);
  const std::size_t pass = std::min(most, kPassLights);
  auto& [light, result, workspace] = scratch;
  light.resize(most * n);
  result.resize(most * n);
  workspace.resize(transfer.batch_workspace_size(pass));
  const std::vector<float>& area = data.patches.area;
  for (std::size_t begin = 0; begin < columns; begin += most) {
    const std::size_t count = std::min(most, columns - begin);
    turn(n, order, begin, count, light, [&](std::size_t at, float& value, std::size_t i) {
      value = static_cast<float>(in[at]);
      if (adjoint) value /= area[i];
    });
    for (std::size_t k = 0; k < count; k += pass) {
      const std::size_t together = std::min(pass, count - k);
      transfer.apply_batch(together, std::span(light).subspan(k * n, together * n),
                           std::span(result).subspan(k * n, together * n), workspace);
    }
    turn(n, order, begin, count, result, [&](std::size_t at, float& value, std::size_t i) {
      out[at] = static_cast<Number>(adjoint ? value * area[i] : value);
    });
  }
}

template <typename Number>
py::array apply_to(const Data& data, const Array<Number>& light, bool adjoint, bool by_column) {
  if (!data->transfer) throw Error("the transfer data have no operator");
  if (adjoint && !data->transfer->roles().all_are_both()) {
    throw Error("an operator with receivers and sources has no adjoint");
  }
  const auto rows = static_cast<py::ssize_t>(kChannelCount * data->patches.size());
  check_shape(light, {by_column ? -1 : rows, by_column ? rows : -1}, "light");
  py::array_t<Number> result({light.shape(0), light.shape(1)});
  const Number* in = light.data();
  Number* out = result.mutable_data();
  const auto columns = static_cast<std::size_t>(light.shape(by_column ? 0 : 1));
  const BlockOrder order =
      by_column ? BlockOrder{1, static_cast<std::size_t>(rows)} : BlockOrder{columns, 1};
  const py::gil_scoped_release unlocked;
  std::unique_ptr<ProductScratch> scratch = data.memory->take();
  apply(*data, in, out, columns, order, adjoint, *scratch);
  data.memory->give(std::move(scratch));
  return result;
}

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
      .def("apply", &apply_to<float>, py::arg("light").noconvert(), py::arg("adjoint"),
           py::arg("by_column"))
      .def("apply", &apply_to<double>, py::arg("light"), py::arg("adjoint"), py::arg("by_column"));
  py::class_<FormFactors>(module, "FormFactors")
      .def(py::init<const Data&>())
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
