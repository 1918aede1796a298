#pragma once

#include <cstdint>
#include <span>

#include "bench/reference/path_tracer.h"

namespace rebounce::reference {

/// A point light at a good place for `scene`: in free space, where it reaches much of the
/// surface that sees other surfaces and is not close to any of it. It sends out 100 lm for each m²
/// of the lit ones of `sides` [t] (find_lit_sides). The same `seed`, the same light.
Light make_key_light(const Scene& scene, const RayTracer& tracer,
                     std::span<const TriangleSides> sides, std::uint64_t seed = 1);

}  // namespace rebounce::reference
