#pragma once

// What of the error of shown light is made where: by patches that receive, by patches that send,
// and by interpolation between vertices.

#include <span>

#include "bench/reference/compare.h"
#include "bench/reference/path_tracer.h"

namespace rebounce::reference {

/// How far from the truth the light at points is, if it comes there in other ways than by the
/// reconstruction weights. Rows are the view of a place along rays: what part of it each patch is.
struct ReceiverErrors {
  RelativeError patch_value;   ///< that of the patch on which the point lies
  RelativeError rows;          ///< a row of the point's own, times the radiosity of patches
  RelativeError smooth_light;  ///< as `rows`, but patches reflect the indirect light shown on them
  RelativeError exact_lamps;   ///< as `rows`, but lamps are looked at where each ray ends
  RelativeError exact_both;    ///< as `rows`, with both: patches only carry reflectance and sky
};

/// The light of the patches of a scene.
struct PatchSolution {
  const TransferData& data;
  const RayTracer& mesh_tracer;                 ///< over the surface of data.mesh
  std::span<const Float3> indirect_irradiance;  ///< [n] lx
  std::span<const Light> lights;
  Sky sky;
};

/// Compares the light at the points that were `shown` with the `truth` at `points`. Throws Error if
/// sizes do not agree or the lights cannot be used.
ReceiverErrors compare_receivers(const PatchSolution& solution,
                                 const ReconstructionComparison& shown,
                                 std::span<const SurfacePoint> points,
                                 const IrradianceEstimate& truth, std::uint64_t seed);

}  // namespace rebounce::reference
