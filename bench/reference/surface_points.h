#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/import/scene.h"
#include "precompute/patches/lit_sides.h"

namespace rebounce::reference {

/// A point on one side of a surface.
struct SurfacePoint {
  Float3 position{0, 0, 0};        ///< metres
  Float3 normal{0, 0, 0};          ///< unit geometric normal, on the side that is meant
  std::uint32_t triangle = kNone;  ///< of the mesh that the point was taken from
  Float2 barycentric{0, 0};        ///< weights of the second and third vertex
};

/// `count` points spread uniformly by area over the lit ones of `sides` [t] (find_lit_sides), each
/// from a stratum of equal area. The same `seed`, the same points. Throws Error if there is
/// no such side or its area is not finite.
std::vector<SurfacePoint> sample_surface(const Scene& scene, std::span<const TriangleSides> sides,
                                         std::size_t count, std::uint64_t seed);

}  // namespace rebounce::reference
