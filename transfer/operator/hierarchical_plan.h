#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/kernels/block_kernels.h"

namespace rebounce {

/// What an apply of a hierarchical operator does, in three phases that each stream through its
/// values: the light of the clusters to its coefficients in the bases; coupling matrices and dense
/// blocks; coefficients back to the light that arrives. Where there are cluster coefficients, some
/// of the coefficients are the light that others are of, so that the first and the last phase have
/// two steps. Within a step all tasks write to places of their own, whatever thread works on them:
/// no sum depends on the number of threads.
class HierarchicalPlan {
 public:
  /// Parts of a step at most: enough for the threads of a desktop to share it evenly.
  static constexpr std::uint64_t kMostParts = 16;

  /// Positions or cluster coefficients that one thread works out from the first addition to the
  /// last.
  struct Arrival {
    std::uint32_t begin, end;  ///< multiples of kAlignment
    std::uint32_t first_expansion, last_expansion;
    std::uint32_t first_dense, last_dense;
    std::uint32_t first_target, last_target;

    std::uint32_t target_count() const { return last_target - first_target; }
  };

  /// Cluster coefficients of one block, and the coefficients in its basis that they are times their
  /// scales.
  struct ClusterCoefficients {
    std::uint32_t coefficient, rank, residual_rank;
    std::uint32_t position;  ///< of the first, after those of patches
    std::uint32_t scale;     ///< of the first
  };

  /// Everything that it takes to write the positions `targets`, ascending, and to leave the patches
  /// `dark` without light.
  HierarchicalPlan(const HierarchicalStorage& storage, const HierarchicalLayout& layout,
                   std::vector<std::uint32_t> targets, std::vector<std::uint32_t> dark);

  std::vector<BasisPart> projections;          ///< of the light at positions
  std::vector<BasisPart> cluster_projections;  ///< of cluster coefficients
  std::vector<ClusterCoefficients> coefficients_in, coefficients_out;
  std::vector<CouplingBlock> couplings;
  std::vector<DenseBlock>
      dense;  ///< where there is one matrix; of several they are among the coupling matrices
  std::vector<BasisPart> expansions;
  std::vector<DenseEnd> dense_in,
      dense_out;  ///< those in of coupling matrices; those out cut at the arrivals
  std::vector<std::uint32_t> targets;
  std::vector<std::uint32_t> dark;
  std::vector<Arrival> arrivals;          ///< at positions
  std::vector<Arrival> cluster_arrivals;  ///< at cluster coefficients, without targets
  /// [first, last) of the parts of about equal work that threads take in turn.
  std::vector<std::uint32_t> projection_parts, cluster_projection_parts, coupling_parts,
      dense_parts;
  std::uint64_t value_count = 0;  ///< that are read, each counted once
};

}  // namespace rebounce
