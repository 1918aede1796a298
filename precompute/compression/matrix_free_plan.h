#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "precompute/compression/hierarchical_settings.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

struct MatrixFreeTransferSettings {
  HierarchicalSettings compression{};  ///< of the result
  /// Only the transfer from sources to receivers is solved for and stored: for the couplings of
  /// cells of sources or of receivers, whichever are fewer.
  PatchRoles roles{};
  /// The group of each patch (group_patches), [n]; empty if all are of one. They are those that the
  /// form factors are compressed with.
  std::vector<std::uint8_t> group{};
  /// Limit of the memory beside the form factors, bytes; 0: none. A lower limit means fewer
  /// threads: slower, with the same bits.
  std::uint64_t memory_limit_bytes = 0;
  /// Folder that keeps finished work, couplings of cells and parts of the rounds of the search, so
  /// that a run that was killed continues; empty: none. Work that was made from other arguments is
  /// made again. The folder stays behind: remove it when the operator is saved.
  std::filesystem::path checkpoint{};
};

/// How much work build_matrix_free_transfer does at the same time.
struct MatrixFreeTransferPlan {
  int thread_count = 1;
  std::size_t cell_count = 1;  ///< cells of 512 patches whose couplings are solved for together
  /// At the peak, without the form factors; in proportion to the number of patches.
  std::size_t peak_bytes = 0;
};

/// What the memory of an operator depends on, beside its settings.
struct MatrixFreeTransferSize {
  std::size_t patch_count = 0;
  std::size_t matrix_count = 1;  ///< distinct reflectance channels
  /// The part of the hemispheres over patches, on average, that is open to the sky.
  double open_part = 0;
  /// Once bases are known; a plan is for as many as in rooms at the least.
  std::uint64_t coupling_count = 0;
};

/// The plan with the most threads, at most those of OpenMP, that keeps to the limit of `settings`.
/// Only a plan with one thread may be above the limit: no plan takes less.
MatrixFreeTransferPlan plan_matrix_free_transfer(const MatrixFreeTransferSize& size,
                                                 const MatrixFreeTransferSettings& settings = {});

/// The mean of `sky_visibility` [n]; 0 where there is none.
double mean_open_part(std::span<const float> sky_visibility);

/// Peak memory of compressing a dense operator (f32) to a hierarchical one, with the dense one.
std::uint64_t dense_compression_peak_bytes(std::size_t patch_count, std::size_t matrix_count);

/// Throws Error if the plan for so many patches is above the limit of `settings`.
void check_memory(std::size_t patch_count, const MatrixFreeTransferPlan& plan,
                  const MatrixFreeTransferSettings& settings);

}  // namespace rebounce
