#pragma once

// How far the indirect irradiance of a transfer file is from the path tracer's: what patches, form
// factors, direct light at patches and reconstruction cost together.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bench/reference/path_tracer.h"
#include "precompute/base/progress.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::reference {

/// A relative difference in the area-weighted L2 norm over places and channels, both parts of the
/// norm of the truth.
struct RelativeError {
  /// The noise of the path tracer is taken out: sqrt(max(0, measured² - noise²)).
  double error = 0;
  double noise = 0;                ///< what the path tracer's noise alone would measure
  std::size_t count = 0;           ///< places compared
  std::size_t left_out_count = 0;  ///< places that could not be
};

struct PatchComparisonSettings {
  /// Patches to compare, chosen in proportion to their area; all of them if there are no more, or
  /// if it is 0. More: less chance in the figure, time in proportion.
  std::size_t patch_count = 2000;
  /// Points on each patch, rounded up to a multiple of kReplicateCount. More: less noise.
  std::uint32_t points_per_patch = 64;
  /// Paths from each point, rounded up likewise.
  std::uint32_t samples_per_point = 64;
  std::uint64_t seed = 1;
};

struct PatchComparison {
  RelativeError relative;
  std::vector<std::uint32_t> patch;    ///< [m] the compared patches, ascending
  std::vector<Float3> truth;           ///< [m] the path tracer's means of H over them, lx
  std::vector<Float3> standard_error;  ///< [m] of the truth, lx
  std::vector<double> weight;          ///< [m] in sums over the surface
};

/// Compares `indirect_irradiance` [n] of the patches of `data` with the path tracer's mean over
/// each of them: over points spread evenly over the patch's display triangles. `data` must have
/// been made of `lit_scene.scene`. Throws Error if the sizes do not agree or no patch has a
/// triangle, Cancelled when `progress` says so.
PatchComparison compare_patch_means(const TransferData& data,
                                    std::span<const Float3> indirect_irradiance,
                                    const LitScene& lit_scene,
                                    const PatchComparisonSettings& settings,
                                    const Progress& progress = {});

/// Compares another indirect irradiance [n] of the same patches with what `traced` holds already.
RelativeError compare_patch_means(const PatchComparison& traced,
                                  std::span<const Float3> indirect_irradiance);

/// What is shown at the points that could be compared.
struct ReconstructionComparison {
  RelativeError relative;
  RelativeError seen;                   ///< at the points that are seen from afar alone
  std::vector<std::uint32_t> point;     ///< [m] number of each, ascending
  std::vector<std::uint32_t> triangle;  ///< [m] of the display mesh, where it lies
  std::vector<Float3> shown;            ///< [m] lx
};

/// Compares the smooth reconstruction of `indirect_irradiance` [n] with the path tracer's `truth`
/// at `points` (sample_surface), each of equal weight. The value at a point is that of the display
/// mesh: patch values brought to its vertices by the reconstruction weights and, with `radiosity`
/// [n] in lx, by the rows of vertices that data has, then interpolated.
///
/// `mesh_tracer` holds the first surface_count triangles of data.mesh. Left out are points whose
/// view is all but back faces (the floor under a box: nobody sees them) and points that the mesh
/// does not have. A point is seen if more than a twentieth of its view goes on for 1/64 of the root
/// of the surface's area, the size of one of 4,096 patches: the wall behind a cornice is not.
/// Throws Error if the sizes do not agree or the mesh has no weights.
ReconstructionComparison compare_reconstruction(const TransferData& data,
                                                const RayTracer& mesh_tracer,
                                                std::span<const Float3> indirect_irradiance,
                                                std::span<const SurfacePoint> points,
                                                const IrradianceEstimate& truth,
                                                std::span<const Float3> radiosity = {});

}  // namespace rebounce::reference
