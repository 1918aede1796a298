#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "precompute/compression/hierarchical_settings.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

struct MatrixFreeTransferSettings {
  HierarchicalSettings compression{};  ///< of the result
  /// What the light of sources does to receivers is solved for and stored: as many columns as there
  /// are of those, whichever are the fewer.
  PatchRoles roles{};
  /// Memory that may be taken beside the form factors; 0: as much as it takes. Less: fewer threads
  /// and panels at a time, slower, the same bits.
  std::uint64_t memory_limit_bytes = 0;
  /// Folder that what is finished is kept in, panels of the first stage and parts of the rounds of
  /// the second, so that a run that was killed goes on where it was; empty: none. What was begun
  /// from anything else is begun anew. It stays behind: remove it when the operator is where it
  /// belongs.
  std::filesystem::path checkpoint{};
};

/// How much of build_matrix_free_transfer is done at the same time.
struct MatrixFreeTransferPlan {
  int thread_count = 1;
  std::size_t panel_count = 1;  ///< of 512 columns each, solved for together
  /// At the peak, form factors not included; in proportion to the number of patches.
  std::size_t peak_bytes = 0;
};

/// The plan with the most threads, those of OpenMP at most and one at least, that keeps to the
/// limit of `settings`. Above it is only the plan with one thread: less cannot be done with.
MatrixFreeTransferPlan plan_matrix_free_transfer(std::size_t patch_count, std::size_t matrix_count,
                                                 const MatrixFreeTransferSettings& settings = {});

/// Throws Error if the plan for so many patches is above the limit of `settings`.
void check_memory(std::size_t patch_count, const MatrixFreeTransferPlan& plan,
                  const MatrixFreeTransferSettings& settings);

}  // namespace rebounce
