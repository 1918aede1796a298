#pragma once

// NumPy arrays to and from the library's.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <span>
#include <string>
#include <vector>

#include "rebounce/types.h"
#include "transfer/base/finite_values.h"

namespace rebounce::python {

namespace py = pybind11;

/// C-contiguous, converted if it is not.
template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// Throws ValueError unless all `values` are finite: integers that light is rounded to in a product
/// have no number for what is not.
template <typename Number>
void check_finite(std::span<const Number> values, const char* name) {
  if (are_finite(values)) return;
  throw py::value_error(std::string(name) + " has a number that is not finite");
}

/// Throws ValueError unless the shape is `shape`; -1 fits any.
inline void check_shape(const py::array& array, const std::vector<py::ssize_t>& shape,
                        const std::string& name) {
  bool right = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t axis = 0; right && axis < shape.size(); ++axis) {
    right = shape[axis] < 0 || array.shape(static_cast<py::ssize_t>(axis)) == shape[axis];
  }
  if (right) return;
  const auto text = [](const py::ssize_t* sizes, std::size_t count) {
    std::string all;
    for (std::size_t axis = 0; axis < count; ++axis) {
      all += (axis > 0 ? ", " : "") +
             (sizes[axis] < 0 ? std::string("any") : std::to_string(sizes[axis]));
    }
    return "[" + all + "]";
  };
  throw py::value_error(name + " has the shape " +
                        text(array.shape(), static_cast<std::size_t>(array.ndim())) +
                        ", and needs " + text(shape.data(), shape.size()));
}

/// A read-only view of `values` in `shape`; `owner` keeps them alive.
template <typename T>
py::array_t<T> view_of(const T* values, std::vector<py::ssize_t> shape, const py::handle& owner) {
  py::array_t<T> array(std::move(shape), values, owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

template <typename T>
py::array_t<T> view_of(std::span<const T> values, const py::handle& owner) {
  return view_of(values.data(), {static_cast<py::ssize_t>(values.size())}, owner);
}

inline py::array_t<float> view_of(std::span<const Float3> values, const py::handle& owner) {
  return view_of(values.empty() ? nullptr : values.front().data(),
                 {static_cast<py::ssize_t>(values.size()), 3}, owner);
}

/// An array that takes `values` over.
template <typename T>
py::array_t<T> array_of(std::vector<T> values) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>({static_cast<py::ssize_t>(kept->size())}, kept->data(), owner);
}

inline py::array_t<float> array_of(std::vector<Float3> values) {
  auto* kept = new std::vector<Float3>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Float3>*>(p); });
  const auto* first = kept->empty() ? nullptr : kept->front().data();
  return py::array_t<float>({static_cast<py::ssize_t>(kept->size()), py::ssize_t{3}}, first, owner);
}

/// The rows of an array [n, 3].
inline std::span<const Float3> rows_of(const Array<float>& array) {
  return {reinterpret_cast<const Float3*>(array.data()), static_cast<std::size_t>(array.shape(0))};
}

}  // namespace rebounce::python
