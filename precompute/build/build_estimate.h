#pragma once

#include <cstddef>
#include <cstdint>

#include "precompute/base/progress.h"
#include "precompute/build/build_report.h"
#include "precompute/build/build_settings.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

/// What the build may take: as it was set, or half of the machine's memory.
std::uint64_t memory_limit_bytes(const BuildSettings& settings);

/// Peak of form factors and operator from pairs, where half of all patches face each other.
/// `matrix_count`: distinct reflectance channels; `kind`: not kAutomatic.
std::uint64_t peak_bytes_of_pairs(std::size_t patch_count, std::size_t matrix_count,
                                  OperatorKind kind);

/// What the memory of a build from links follows from.
struct LinkedBuild {
  std::size_t patch_count = 0;
  std::size_t link_count = 0;
  std::uint32_t matrix_count = 1;  ///< distinct reflectance channels
  PatchRoles roles{};
  double tolerance = 0.005;  ///< of the operator
};

/// Peak of finding the links.
std::uint64_t peak_bytes_of_links(const LinkedBuild& build);

/// Peak of all that comes after links, with the threads that fit the limit, one at least.
std::uint64_t peak_bytes_after_links(const LinkedBuild& build, std::uint64_t limit_bytes);

/// What of a limit is left for build_matrix_free_transfer; 1 where it is nothing.
std::uint64_t memory_of_matrix_free_transfer(const LinkedBuild& build, std::uint64_t limit_bytes);

/// The memory that form factors and operator need; no times. `decided`: settings that leave nothing
/// open. Links are taken to be as many as in a furnished room, until they are known.
CostEstimate estimate_cost(const PatchModel& model, const PatchRoles& roles,
                           const BuildSettings& decided);

/// Adds the time that form factors and a dense inverse from pairs take, by short samples of either.
/// Throws Cancelled if asked to stop.
void sample_pairs(const PatchModel& model, const RayTracer& tracer, const BuildSettings& decided,
                  const Progress& progress, CostEstimate& estimate);

/// The memory of what comes after links.
CostEstimate estimate_after_links(const LinkedBuild& build, std::uint64_t limit_bytes);

/// Throws Error if an estimate is above `limit_bytes`.
void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count);

}  // namespace rebounce
