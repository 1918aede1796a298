#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "rebounce/scene_data.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The memory that a build may take: the limit of the settings, or half of the memory of the
/// machine.
std::uint64_t memory_limit_bytes(const BuildSettings& settings);

/// The quantities that the memory of every build depends on.
struct BuiltScene {
  std::size_t patch_count = 0;
  std::size_t vertex_count = 0;          ///< of the mesh that is shown
  std::size_t micro_triangle_count = 0;  ///< of triangles with opacity maps
  /// Bytes of rows of receivers while they are found, in a stage of their own: those of the
  /// patches, as sparse as rays leave them, and twice what is stored.
  std::uint64_t row_bytes = 0;
};

/// Those of patches and their mesh, without rows of receivers.
BuiltScene built_scene(std::size_t patch_count, const DisplayMesh& mesh);

/// Those of a model, with the rows of receivers that `decided` asks for.
BuiltScene built_scene(const PatchModel& model, const BuildSettings& decided);

/// The quantities that the memory of a build from pairs depends on.
struct PairsBuild {
  BuiltScene scene{};
  std::uint64_t held_bytes = 0;  ///< by the process before
  std::size_t pair_count = 0;    ///< pairs of patches that exchange light
  std::size_t matrix_count = 1;  ///< distinct reflectance channels
  OperatorKind kind = OperatorKind::kNoOperator;
  std::size_t rank = 0;  ///< of a low-rank operator
};

/// Of a process that holds its patches, if half of all pairs exchange light.
PairsBuild pairs_build(const BuiltScene& scene, std::size_t matrix_count,
                       const BuildSettings& settings);

/// Peak memory of the process while it makes form factors and operator from pairs.
std::uint64_t peak_bytes_of_pairs(const PairsBuild& build);

/// The quantities that the memory of a build from links depends on.
struct LinkedBuild {
  BuiltScene scene{};
  std::uint64_t held_bytes = 0;  ///< by the process without links
  std::size_t link_count = 0;
  std::uint32_t matrix_count = 1;  ///< distinct reflectance channels
  PatchRoles roles{};
  double tolerance = kDefaultTolerance;  ///< of the operator
  double open_part = 0;                  ///< of MatrixFreeTransferSize
};

/// Of a model of which links take `link_bytes` of the memory at present.
LinkedBuild linked_build(const BuiltScene& scene, std::size_t link_count, std::uint64_t link_bytes,
                         const PatchTable& patches, const PatchRoles& roles, double tolerance);

/// Peak memory of the process while links are found.
std::uint64_t peak_bytes_of_links(const LinkedBuild& build);

/// Peak memory of the process in all stages after links, with as many threads as the limit allows,
/// at least one.
std::uint64_t peak_bytes_after_links(const LinkedBuild& build, std::uint64_t limit_bytes);

/// The threads that all stages after links may have, so that they keep the limit if one can: a
/// thread's buffers stay once a stage has used them.
int thread_count_after_links(const LinkedBuild& build, std::uint64_t limit_bytes);

/// The part of a limit that remains for build_matrix_free_transfer; 1 if nothing remains.
std::uint64_t memory_of_matrix_free_transfer(const LinkedBuild& build, std::uint64_t limit_bytes);

/// The links that a build is likely to end with, which judges them and makes them finer, of those
/// that are forecast at first.
std::size_t finer_link_count(std::size_t forecast, std::size_t patch_count);

/// The memory that form factors and operator need, without times. `decided`: settings that leave
/// nothing open. `link_count` is forecast (forecast_link_count), and 0 for pairs.
CostEstimate estimate_cost(const PatchModel& model, const PatchRoles& roles,
                           const BuildSettings& decided, std::size_t link_count);

/// Adds the time that form factors and a dense inverse from pairs take, by short samples of either,
/// and corrects the memory by the pairs that exchange light. Throws Cancelled if asked to stop.
void sample_pairs(const PatchModel& model, const RayTracer& tracer, const BuildSettings& decided,
                  const Progress& progress, CostEstimate& estimate);

/// The least that a build needs, known before its patches are made: the memory that links of as
/// many patches take without a link. 0 for up to kPairsPatchCount patches: these are soon made, and
/// then more is known.
CostEstimate least_cost(const Scene& scene, const SubdivisionSettings& settings);

/// The memory of the stages after links, once their number is known.
CostEstimate estimate_after_links(const LinkedBuild& build, std::uint64_t limit_bytes);

/// The memory that a build has taken so far. It begins with this object: what the process had at
/// its peak before is not the build's.
class TakenMemory {
 public:
  TakenMemory();

  /// The peak of the process, in bytes; 0 if it had as much before, to a MiB.
  std::uint64_t bytes() const;

 private:
  std::uint64_t before_;
};

/// Throws Error if an estimate is above `limit_bytes`.
void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count);

}  // namespace rebounce
