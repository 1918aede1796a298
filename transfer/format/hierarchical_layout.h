#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Where the values and the coefficients of a hierarchical operator lie in the order kStreamed.
/// Coefficients are numbered like the rows of the bases: those of a cluster one after the other, up
/// to a multiple of `rank_group`. Those of dense blocks, whose bases are the identity, follow.
struct HierarchicalLayout {
  /// All bases over one cluster of positions: [rank][size], or in 16 bits in strips and groups of
  /// ranks, the last of which is filled up with zeros (HierarchicalStorage::Order).
  struct Cluster {
    std::uint32_t begin = 0, size = 0;  ///< positions
    std::uint32_t rank = 0;
    std::uint32_t coefficient = 0;  ///< the first
    std::uint64_t values = 0;       ///< where they begin
  };

  /// One end of a block.
  struct End {
    std::uint32_t cluster = 0;        ///< low-rank blocks only
    std::uint32_t coefficient = 0;    ///< the first
    std::uint32_t residual_rank = 0;  ///< that are stored, after the vectors of the basis
  };
  struct Place {
    End row, column;           ///< the same on the diagonal
    std::uint64_t values = 0;  ///< where S or the entries begin, after the bases
  };

  /// The blocks must be checked. Throws Error if they hold more values than any memory.
  HierarchicalLayout(std::span<const TransferBlock> blocks, std::uint32_t matrix_count,
                     BasisPrecision precision);

  /// Of the blocks of an operator.
  explicit HierarchicalLayout(const HierarchicalStorage& storage)
      : HierarchicalLayout(storage.blocks, storage.matrix_count, storage.precision.bases) {}

  /// Where the value of a basis is: a rank of one end of a low-rank block, at a position of its
  /// cluster.
  std::uint64_t basis_index(const End& end, std::uint64_t rank, std::uint64_t position) const;

  std::vector<Cluster> clusters;  ///< by begin, then by size, the largest first
  std::vector<Place> places;      ///< by block
  std::uint64_t basis_value_count = 0;
  std::uint64_t coupling_value_count = 0;  ///< coupling matrices and dense entries
  std::uint32_t coefficient_count = 0;
  std::size_t largest_taken = 0;  ///< taken_size() of the largest coupling matrix
  std::uint32_t rank_group;       ///< ranks that are kept together: 1, or of integers kRankGroup
  std::uint32_t cluster_coefficient_count = 0;

  /// `value_count` values with the zeros that follow them.
  static std::uint64_t padded(std::uint64_t value_count);

 private:
  std::uint64_t filled_rank(const Cluster& cluster) const;
  void find_clusters(std::span<const TransferBlock> blocks);
  std::uint32_t cluster_at(std::uint32_t begin, std::uint32_t size) const;
  void place_bases(std::span<const TransferBlock> blocks, BasisPrecision precision);
  void place_couplings(std::span<const TransferBlock> blocks, std::uint32_t matrix_count);
};

/// Whether a block has values.
bool has_values(const TransferBlock& block);

inline bool is_cluster_basis(const TransferBlock& block) {
  return block.kind == TransferBlock::Kind::kClusterBasis;
}

}  // namespace rebounce
