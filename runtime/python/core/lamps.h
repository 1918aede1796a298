#pragma once

// Lamps and skies of the package, whose fields have the names of light files.

#include <pybind11/pybind11.h>

#include <span>
#include <vector>

#include "rebounce/lights.h"
#include "rebounce/sky.h"

namespace rebounce::python {

/// The lights of a sequence of objects with the fields of rebounce.Light. Throws ValueError, with
/// the number of the light, if one has a field of a wrong kind or type.
std::vector<Light> lights_from(const pybind11::sequence& lights);

/// A list of dictionaries with the fields of rebounce.Light.
pybind11::list lights_of(std::span<const Light> lights);

/// The sky of an object with the fields of rebounce.Sky; None: a dark one.
Sky sky_from(const pybind11::object& sky);

}  // namespace rebounce::python
