#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/precompute/progress.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Relative area-weighted L2 errors of the operator's indirect irradiance against the
/// double-precision solution, one for each of a number of random lights.
struct MeasuredError {
  double mean = 0;
  double max = 0;
};

/// `count` point lights at random places in the free space of the scene: on the way of a
/// cosine-distributed ray from a random patch to what it hits. The same `seed`, the same lights.
std::vector<Light> random_point_lights(const TransferData& data, const RayTracer& tracer, int count,
                                       std::uint64_t seed);

/// What such lights, one at a time, make the patches give off for the first time: initial exitances
/// [count][n] in lx.
std::vector<std::vector<Float3>> random_initial_exitances(const TransferData& data,
                                                          const RayTracer& tracer, int count,
                                                          std::uint64_t seed);

/// Measures data.transfer under `light_count` such lights.
MeasuredError measure_error(const TransferData& data, const RayTracer& tracer, int light_count,
                            std::uint64_t seed, const Progress& progress = {});

}  // namespace rebounce
