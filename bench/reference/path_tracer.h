#pragma once

// The reference integrator: unbiased diffuse path tracing on the scene as it was imported, without
// patches. notes/reference/path_tracer.md says what is sampled how.

#include <cstdint>
#include <span>
#include <vector>

#include "bench/reference/surface_points.h"
#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "rebounce/sky.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce::reference {

/// A scene and the light that falls into it. What it refers to must outlive it.
struct LitScene {
  const Scene& scene;
  const RayTracer& tracer;  ///< over all triangles of `scene`, in their order
  std::span<const Light> lights;
  Sky sky;
};

/// A ray tracer over all triangles of `scene`.
RayTracer make_scene_tracer(const Scene& scene);

/// What was measured at each of n points.
struct IrradianceEstimate {
  std::vector<Float3> mean;            ///< [n] lx
  std::vector<Float3> standard_error;  ///< [n] lx, from independent parts of the samples
  std::vector<float> absorbed;  ///< [n] cosine-weighted fraction of the view that is back faces
};

/// Samples are taken in this many independent parts, whose spread gives the standard error.
inline constexpr std::uint32_t kReplicateCount = 8;

/// Estimates the indirect irradiance H = F B (DESIGN: light that arrives from other surfaces, their
/// own emission included, the direct light of lamps and sky left out) at `points`.
///
/// `samples_per_point` paths begin at every point, rounded up to a multiple of kReplicateCount. The
/// same `seed` gives the same bits for any number of OpenMP threads. Throws Error if
/// samples_per_point is 0, Cancelled when `progress` says so.
IrradianceEstimate indirect_irradiance(const LitScene& lit_scene,
                                       std::span<const SurfacePoint> points,
                                       std::uint32_t samples_per_point, std::uint64_t seed,
                                       const Progress& progress = {});

}  // namespace rebounce::reference
