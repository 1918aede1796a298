// Frames by an engine, skies, and solutions by iteration.

#include <pybind11/stl.h>

#include <memory>

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "rebounce/solvers.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/lamps.h"
#include "runtime/python/core/module.h"

namespace rebounce::python {
namespace {

using EngineMaker = std::unique_ptr<Engine>;

EngineMaker make_engine(const Data& data, int points_per_patch, int area_light_samples) {
  EngineSettings settings;
  settings.direct_lighting = {.points_per_patch = points_per_patch,
                              .area_light_samples = area_light_samples};
  const py::gil_scoped_release unlocked;
  return std::make_unique<Engine>(data.transfer, settings);
}

void relight(Engine& engine, const py::sequence& lights, const py::object& sky) {
  const std::vector<Light> lamps = lights_from(lights);
  const Sky above = sky_from(sky);
  const py::gil_scoped_release unlocked;
  engine.relight(lamps, above);
}

void relight_by_direct(Engine& engine, const Array<float>& direct) {
  const auto n = static_cast<py::ssize_t>(engine.direct_irradiance().size());
  check_shape(direct, {n, 3}, "direct_irradiance");
  const py::gil_scoped_release unlocked;
  engine.relight(rows_of(direct));
}

/// A property that views the light of the last frame.
template <std::span<const Float3> (Engine::*kLight)() const>
py::array_t<float> light_of(const py::object& self) {
  return view_of((self.cast<const Engine&>().*kLight)(), self);
}

SolveMethod solve_method(const std::string& name) {
  if (name == "hierarchical") return SolveMethod::kJacobi;
  for (const NamedSolveMethod& known : kSolveMethods) {
    if (known.name == name) return known.method;
  }
  std::string names = "transfer, hierarchical";
  for (const NamedSolveMethod& known : kSolveMethods) names += ", " + std::string(known.name);
  throw py::value_error("method must be one of " + names + ", not \"" + name + "\"");
}

py::tuple solve(const Data& data, const Array<float>& initial_exitance, const std::string& method,
                double residual, int max_sweeps) {
  check_shape(initial_exitance, {static_cast<py::ssize_t>(data->patches.size()), 3},
              "initial_exitance");
  const SolveMethod chosen = solve_method(method);
  std::vector<Float3> radiosity(data->patches.size());
  SolveResult result;
  {
    const py::gil_scoped_release unlocked;
    Solver solver(data.transfer, chosen,
                  method == "hierarchical" ? FormFactorSource::kLinks : FormFactorSource::kBest);
    result = solver.solve(rows_of(initial_exitance),
                          {.max_sweeps = max_sweeps, .residual = residual}, radiosity);
  }
  py::dict how;
  how["sweeps"] = result.sweeps;
  how["residual"] = result.residual;
  how["converged"] = result.converged;
  how["diverged"] = result.diverged;
  how["microseconds"] = result.microseconds;
  return py::make_tuple(array_of(std::move(radiosity)), how);
}

std::unique_ptr<ErrorEstimator> make_error_estimator(const Data& data) {
  const py::gil_scoped_release unlocked;
  return std::make_unique<ErrorEstimator>(data.transfer);
}

py::tuple estimate_error(ErrorEstimator& estimator, const Engine& engine) {
  ErrorEstimate found;
  {
    const py::gil_scoped_release unlocked;
    found = estimator.estimate_error(engine.initial_exitance(), engine.indirect_irradiance(),
                                     engine.scheduler());
  }
  return py::make_tuple(found.error, found.bound);
}

std::vector<float> cie_sky_of(int type, const Float3& sun_direction, float ground_reflectance) {
  const SkyDistribution sky = cie_sky(type, sun_direction, ground_reflectance);
  return {sky.begin(), sky.end()};
}

std::vector<std::uint32_t> cells_of(const Array<float>& directions) {
  check_shape(directions, {-1, 3}, "directions");
  std::vector<std::uint32_t> cells;
  for (const Float3& direction : rows_of(directions)) cells.push_back(sky_cell(direction));
  return cells;
}

}  // namespace

void add_frame(py::module_& module) {
  py::class_<Engine>(module, "Engine")
      .def(py::init(&make_engine), py::arg("data"), py::arg("points_per_patch"),
           py::arg("area_light_samples"))
      .def("relight", &relight, py::arg("lights"), py::arg("sky"))
      .def("relight_by_direct", &relight_by_direct, py::arg("direct_irradiance"))
      .def("set_emission_scale",
           [](Engine& engine, std::uint32_t material, const Float3& scale) {
             engine.set_emission_scale(material, scale);
           })
      .def_property_readonly("direct_irradiance", &light_of<&Engine::direct_irradiance>)
      .def_property_readonly("initial_exitance", &light_of<&Engine::initial_exitance>)
      .def_property_readonly("indirect_irradiance", &light_of<&Engine::indirect_irradiance>)
      .def_property_readonly("radiosity", &light_of<&Engine::radiosity>);
  py::class_<ErrorEstimator>(module, "ErrorEstimator")
      .def(py::init(&make_error_estimator), py::arg("data"))
      .def("estimate_error", &estimate_error, py::arg("engine"));
  module.def("solve", &solve, py::arg("data"), py::arg("initial_exitance"), py::arg("method"),
             py::arg("residual"), py::arg("max_sweeps"));
  module.def("cie_sky", [](int type, const Float3& sun_direction, float ground_reflectance) {
    return array_of(cie_sky_of(type, sun_direction, ground_reflectance));
  });
  module.def("sky_cells",
             [](const Array<float>& directions) { return array_of(cells_of(directions)); });
  module.def("point_of_sky_cell", [](std::uint32_t cell, const Float2& place) {
    if (cell == 0 || cell >= kSkyCellCount) throw py::value_error("cells are 1 to 145");
    return point_of_sky_cell(cell, place);
  });
  module.def("sky_cell_solid_angle", [](std::uint32_t cell) {
    if (cell >= kSkyCellCount) throw py::value_error("cells are 0 to 145");
    return sky_cell_solid_angle(cell);
  });
}

}  // namespace rebounce::python
