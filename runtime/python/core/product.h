#pragma once

#include <pybind11/numpy.h>

#include <optional>

#include "runtime/python/core/module.h"

namespace rebounce::python {

/// Y, or its adjoint A Y / A, times the columns of `light` [3 n] or [3 n, k], channel by channel;
/// or one channel of it, times [n] or [n, k]. The result is of the same shape, type and order as
/// `light`; what is neither float32 nor float64 becomes float64. Throws ValueError if the shape is
/// wrong or `light` is complex, Error if there is no operator, or no adjoint.
pybind11::array apply_to_array(const Data& data, const pybind11::array& light, bool adjoint,
                               std::optional<int> channel);

}  // namespace rebounce::python
