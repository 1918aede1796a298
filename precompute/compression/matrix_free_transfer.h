#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "precompute/base/progress.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

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

/// Builds Y = F (I - rho F)^-1, compressed, without any matrix of all pairs: the columns of Yhat
/// are solved for by conjugate gradients, a panel of neighbouring patches at a time, and each panel
/// is compressed finely as soon as it is there. The operator that this leaves, a few times as large
/// as the result, is then compressed to the tolerance as build_hierarchical_transfer does.
///
/// `form_factors` are G = A^1/2 F A^-1/2, compressed, f32 or f16 (compress_form_factors): their
/// error, which must be well below the tolerance, stays in the result and is not part of it. Throws
/// Error if the least that it can do with is above the memory limit, if F is not a passive exchange
/// (I - R G R not positive definite), or if the checkpoint cannot be written, and Cancelled if
/// asked to stop. The same bits for any number of threads and memory limit, and from a checkpoint.
std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches,
    const FittingLights& lights, const MatrixFreeTransferSettings& settings,
    const Progress& progress = {});

}  // namespace rebounce
