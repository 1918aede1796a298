#pragma once

// What single points with a normal see: for light meters.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "rebounce/lights.h"
#include "rebounce/scene_data.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The view of m points, as fractions of their hemispheres weighted by the cosine: with radiosity B
/// in lx and a sky of luminances L the irradiance of point k is the sum of part x B[patch] over
/// [row_begin[k], row_begin[k + 1]) plus pi times the sum of sky[k][c] x L[c].
struct SensorView {
  std::vector<std::uint64_t> row_begin = {0};  ///< [m + 1]
  std::vector<std::uint32_t> patch;            ///< ascending in each row
  std::vector<float> part;
  std::vector<std::array<float, kSkyCellCount>> sky;  ///< [m]
};

/// Measures the view by `ray_count` rays of each point. `normal` [m] are of unit length. The bits
/// do not depend on the number of threads. Throws Error if the sizes differ or ray_count is below
/// 1, Cancelled if asked to stop.
SensorView view_of_sensors(const DisplayMesh& mesh, const RayTracer& tracer,
                           std::span<const Float3> position, std::span<const Float3> normal,
                           int ray_count, const Progress& progress = {});

/// Adds to `irradiance` [m], in lx, what arrives straight from `light` with shadows; a lamp with a
/// surface is looked at in `samples` places. Throws Error if the sizes differ.
void add_direct_irradiance(const RayTracer& tracer, const Light& light,
                           std::span<const Float3> position, std::span<const Float3> normal,
                           int samples, std::span<Float3> irradiance);

}  // namespace rebounce
