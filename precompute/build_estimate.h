#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "rebounce/precompute/build_report.h"
#include "rebounce/precompute/build_settings.h"
#include "rebounce/precompute/patch_model.h"
#include "rebounce/transfer/linked_form_factors.h"
#include "rebounce/transfer/patch_roles.h"

namespace rebounce {

/// What the build may take: as it was set, or half of the machine's memory.
std::uint64_t memory_limit_bytes(const BuildSettings& settings);

/// How fast this machine is in a build from pairs.
struct PairSpeed {
  double form_factor_seconds = 0;    ///< for all of them
  double operations_per_second = 0;  ///< measure_blas_speed
};

/// What form factors and operator of these patches will take, by pairs whatever the settings say.
/// Without a speed that of a slow machine is taken, and rays are guessed.
CostEstimate estimate_cost_of_pairs(const PatchModel& model, const PatchRoles& roles,
                                    const BuildSettings& settings,
                                    const std::optional<PairSpeed>& speed = {});

/// The same of what settings.form_factor_kind, which is no longer open, says. Links are taken to be
/// as many as in a furnished room.
CostEstimate estimate_cost(const PatchModel& model, const PatchRoles& roles,
                           const BuildSettings& settings);

/// What the cost of a build from links follows from.
struct LinkedBuild {
  std::size_t patch_count = 0;
  std::size_t link_count = 0;
  std::uint32_t matrix_count = 1;  ///< distinct reflectance channels
  bool open = false;               ///< to the sky, whose lights are a kind of their own
  PatchRoles roles{};
  double tolerance = 0.005;  ///< of the operator
};

LinkedBuild linked_build(const FormFactorLinks& links, const PatchTable& patches,
                         std::span<const float> sky_visibility, const PatchRoles& roles,
                         double tolerance);

/// What finding the links takes.
CostEstimate estimate_links(const LinkedBuild& build);

/// The same of all that comes after links, with the threads that fit the limit.
CostEstimate estimate_operator_from_links(const LinkedBuild& build, std::uint64_t limit_bytes);

/// What of a limit is left for build_large_transfer; 1 where it is nothing.
std::uint64_t memory_of_large_transfer(const LinkedBuild& build, std::uint64_t limit_bytes);

/// Throws Error if an estimate is above `limit_bytes`.
void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count);

}  // namespace rebounce
