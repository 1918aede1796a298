// View factors and exchange factors of given facets.

#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "precompute/facets/exchange_factors.h"
#include "precompute/facets/read_facets.h"
#include "rebounce/error.h"
#include "runtime/python/core/arrays.h"
#include "runtime/python/core/long_work.h"
#include "runtime/python/core/module.h"

namespace rebounce::python {
namespace {

Facets facets_from(const Array<double>& vertices, const Array<std::uint32_t>& begin,
                   const Array<std::uint32_t>& corners, const Array<std::uint8_t>& obstructs) {
  check_shape(vertices, {-1, 3}, "vertices");
  Facets facets;
  for (py::ssize_t v = 0; v < vertices.shape(0); ++v) {
    facets.vertex.emplace_back(vertices.at(v, 0), vertices.at(v, 1), vertices.at(v, 2));
  }
  facets.corner_begin.assign(begin.data(), begin.data() + begin.size());
  facets.corner.assign(corners.data(), corners.data() + corners.size());
  facets.obstructs_only.assign(obstructs.data(), obstructs.data() + obstructs.size());
  return facets;
}

py::dict arrays_of(ViewFactors factors) {
  py::dict arrays;
  arrays["ray_count"] = factors.ray_count;
  arrays["indptr"] =
      array_of(std::vector<std::int64_t>(factors.row_begin.begin(), factors.row_begin.end()));
  arrays["indices"] = array_of(std::move(factors.column));
  arrays["data"] = array_of(std::move(factors.factor));
  arrays["area"] = array_of(std::move(factors.area));
  arrays["sky"] = array_of(std::move(factors.sky));
  arrays["blocked"] = array_of(std::move(factors.blocked));
  arrays["raw_row_sum"] = array_of(std::move(factors.raw_row_sum));
  arrays["raw_sky"] = array_of(std::move(factors.raw_sky));
  return arrays;
}

py::dict view_factors(const Array<double>& vertices, const Array<std::uint32_t>& begin,
                      const Array<std::uint32_t>& corners, const Array<std::uint8_t>& obstructs,
                      const std::string& quality, bool closed, std::uint64_t seed,
                      const py::object& progress) {
  const ViewFactorSettings settings{
      .quality = quality_named(quality), .seed = seed, .closed = closed};
  const Facets facets = facets_from(vertices, begin, corners, obstructs);
  LongWork work(progress);
  return arrays_of(work.run([&] {
    return compute_view_factors(facets, settings,
                                [&](double done) { return work.report("view factors", done); });
  }));
}

py::tuple read(const std::filesystem::path& path) {
  Facets facets = read_facets(path);
  std::vector<double> vertices;
  for (const glm::dvec3& p : facets.vertex) vertices.insert(vertices.end(), {p.x, p.y, p.z});
  return py::make_tuple(array_of(std::move(vertices)), array_of(std::move(facets.corner_begin)),
                        array_of(std::move(facets.corner)),
                        array_of(std::move(facets.obstructs_only)),
                        array_of(std::move(facets.emissivity)));
}

py::tuple exchange_factors(const Array<std::int64_t>& row_begin, const Array<std::uint32_t>& column,
                           const Array<double>& factor, const Array<double>& area,
                           const Array<double>& sky, const Array<double>& emissivity,
                           const py::object& progress) {
  ViewFactors factors;
  factors.row_begin.assign(row_begin.data(), row_begin.data() + row_begin.size());
  factors.column.assign(column.data(), column.data() + column.size());
  factors.factor.assign(factor.data(), factor.data() + factor.size());
  factors.area.assign(area.data(), area.data() + area.size());
  factors.sky.assign(sky.data(), sky.data() + sky.size());
  const std::vector<double> of_facet(emissivity.data(), emissivity.data() + emissivity.size());
  LongWork work(progress);
  ExchangeFactors result = work.run([&] {
    return compute_exchange_factors(factors, of_facet,
                                    [&](double done) { return work.report("exchange", done); });
  });
  return py::make_tuple(array_of(std::move(result.factor)), array_of(std::move(result.sky)));
}

}  // namespace

void add_facets(py::module_& module) {
  module.def("view_factors", &view_factors, py::arg("vertices"), py::arg("begin"),
             py::arg("corners"), py::arg("obstructs"), py::arg("quality"), py::arg("closed"),
             py::arg("seed"), py::arg("progress"));
  module.def("read_facets", &read, py::arg("path"));
  module.def("exchange_factors", &exchange_factors, py::arg("row_begin"), py::arg("column"),
             py::arg("factor"), py::arg("area"), py::arg("sky"), py::arg("emissivity"),
             py::arg("progress"));
}

}  // namespace rebounce::python
