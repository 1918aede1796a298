// Light meters: what points with a normal see, and what lamps give them.

#include <algorithm>
#include <memory>

#include "precompute/outputs/sensor_view.h"
#include "rebounce/error.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/lamps.h"
#include "runtime/python/core/long_work.h"
#include "runtime/python/core/module.h"

namespace rebounce::python {
namespace {

RayTracer tracer_of(const Data& data) {
  const py::gil_scoped_release unlocked;
  return make_surface_tracer(data->mesh);
}

/// The places of light meters in a scene, and rays through it.
class Sensors {
 public:
  Sensors(const Data& data, const Array<float>& positions, const Array<float>& normals)
      : data_(data.transfer), tracer_(tracer_of(data)) {
    check_shape(positions, {-1, 3}, "positions");
    check_shape(normals, {positions.shape(0), 3}, "normals");
    const auto points = rows_of(positions), directions = rows_of(normals);
    position_.assign(points.begin(), points.end());
    normal_.assign(directions.begin(), directions.end());
  }

  /// (indptr, indices, data) of the view of patches, and the view of the sky [m, 146].
  py::tuple view(int rays, const py::object& progress) const {
    LongWork work(progress);
    SensorView view = work.run([&] {
      return view_of_sensors(data_->mesh, tracer_, position_, normal_, rays,
                             [&](double done) { return work.report("sensors", done); });
    });
    std::vector<float> sky;
    for (const auto& cells : view.sky) sky.insert(sky.end(), cells.begin(), cells.end());
    return py::make_tuple(
        array_of(std::vector<std::int64_t>(view.row_begin.begin(), view.row_begin.end())),
        array_of(std::move(view.patch)), array_of(std::move(view.part)), array_of(std::move(sky)));
  }

  /// What arrives straight from lamps, [m, 3] in lx.
  py::array_t<float> direct(const py::sequence& lights, int samples) const {
    const std::vector<Light> lamps = lights_from(lights);
    std::vector<Float3> irradiance(position_.size(), Float3{0, 0, 0});
    {
      const py::gil_scoped_release unlocked;
      for (const Light& lamp : lamps) {
        add_direct_irradiance(tracer_, lamp, position_, normal_, samples, irradiance);
      }
    }
    return array_of(std::move(irradiance));
  }

 private:
  std::shared_ptr<const TransferData> data_;
  RayTracer tracer_;
  std::vector<Float3> position_, normal_;
};

}  // namespace

void add_sensors(py::module_& module) {
  py::class_<Sensors>(module, "Sensors")
      .def(py::init<const Data&, const Array<float>&, const Array<float>&>(), py::arg("data"),
           py::arg("positions"), py::arg("normals"))
      .def("view", &Sensors::view, py::arg("rays"), py::arg("progress"))
      .def("direct", &Sensors::direct, py::arg("lights"), py::arg("samples"));
}

}  // namespace rebounce::python
