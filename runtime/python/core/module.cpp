#include "runtime/python/core/module.h"

#include <omp.h>

#include "rebounce/error.h"
#include "rebounce/version.h"

namespace py = pybind11;

PYBIND11_MODULE(_core, module) {
  module.doc() = "What the package rebounce is made of; see there.";
  py::register_exception<rebounce::Error>(module, "Error", PyExc_RuntimeError);
  module.attr("__version__") = rebounce::version();
  module.def(
      "set_threads",
      [](int count) {
        if (count < 0) throw py::value_error("threads must be 0 or more");
        omp_set_num_threads(count > 0 ? count : omp_get_num_procs());
      },
      py::arg("count"),
      "The number of threads of work that the calling thread starts from now on; 0: one for "
      "each processor.\n\nOther threads of Python, those of a pool too, keep theirs: call it in "
      "each. Raises ValueError below 0.");
  rebounce::python::add_data(module);
  rebounce::python::add_build(module);
  rebounce::python::add_lamps(module);
  rebounce::python::add_frame(module);
  rebounce::python::add_facets(module);
  rebounce::python::add_sensors(module);
}
