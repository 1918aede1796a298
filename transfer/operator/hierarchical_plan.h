#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/kernels/block_kernels.h"

namespace rebounce {

/// The steps of an apply of a hierarchical operator. Three phases stream through its values:
/// project light to coefficients in the bases, multiply with coupling matrices and dense blocks,
/// expand coefficients to the light that arrives. With nested bases, the first and the last phase
/// have two steps: the cluster coefficients are input or output of other bases. Within a step every
/// task writes to memory of its own, so no sum depends on the number of threads.
class HierarchicalPlan {
 public:
  /// The largest number of parts of a step: enough to balance the threads of a desktop machine.
  /// More parts cut more clusters (lab/044).
  static constexpr std::uint64_t kMostParts = 16;

  /// A range of positions or of cluster coefficients whose light one task computes alone, from the
  /// first addition to the last.
  struct Arrival {
    std::uint32_t begin, end;  ///< multiples of kAlignment
    std::uint32_t first_expansion, last_expansion;
    std::uint32_t first_dense, last_dense;
    std::uint32_t first_target, last_target;

    std::uint32_t target_count() const { return last_target - first_target; }
  };

  /// The cluster coefficients of one cluster basis. They are the coefficients in this basis times
  /// their scales.
  struct ClusterBasis {
    std::uint32_t coefficient, rank, residual_rank;
    std::uint32_t position;  ///< of the first cluster coefficient, numbered after the patches'
    std::uint32_t scale;     ///< index of the first scale
  };

  /// Plans an apply that writes the positions `targets`, in ascending order, and sets the patches
  /// `dark` to 0.
  HierarchicalPlan(const HierarchicalStorage& storage, const HierarchicalLayout& layout,
                   std::vector<std::uint32_t> targets, std::vector<std::uint32_t> dark);

  std::vector<BasisPart> projections;          ///< of light at positions
  std::vector<BasisPart> cluster_projections;  ///< of cluster coefficients
  std::vector<ClusterBasis> cluster_bases_in, cluster_bases_out;
  std::vector<CouplingBlock> couplings;
  std::vector<DenseBlock> dense;  ///< only if there is one matrix; with several, dense blocks are
                                  ///< among the coupling matrices
  std::vector<BasisPart> expansions;
  /// dense_in: inputs of dense blocks among `couplings`; dense_out: outputs, cut at the arrivals.
  std::vector<DenseEnd> dense_in, dense_out;
  std::vector<std::uint32_t> targets;
  std::vector<std::uint32_t> dark;
  std::vector<Arrival> arrivals;          ///< at positions
  std::vector<Arrival> cluster_arrivals;  ///< at cluster coefficients, without targets
  /// Bounds of parts of about equal work: part k is [bound k, bound k + 1).
  std::vector<std::uint32_t> projection_parts, cluster_projection_parts, coupling_parts,
      dense_parts;
  std::uint64_t value_count = 0;  ///< values that an apply reads, each counted once
};

}  // namespace rebounce
