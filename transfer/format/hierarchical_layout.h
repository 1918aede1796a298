#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transfer/format/hierarchical_storage.h"
#include "transfer/format/row_format.h"

namespace rebounce {

/// Offsets of the values and the coefficients of a hierarchical operator in the order kStreamed.
/// Coefficients are numbered like the rows of the bases: cluster by cluster, each cluster padded to
/// a multiple of `rank_group`. The coefficients of dense blocks, whose bases are the identity,
/// follow.
struct HierarchicalLayout {
  /// All bases over one cluster of positions: [rank][size]. Integers are stored in strips and
  /// groups of ranks, and the last group is filled up with zeros (HierarchicalStorage::Order).
  struct Cluster {
    std::uint32_t begin = 0, size = 0;  ///< positions
    std::uint32_t rank = 0;
    std::uint32_t coefficient = 0;  ///< index of the first coefficient
    std::uint64_t values = 0;       ///< index of the first value
  };

  /// The rows or the columns of a block.
  struct End {
    std::uint32_t cluster = 0;        ///< low-rank blocks only
    std::uint32_t coefficient = 0;    ///< index of the first coefficient
    std::uint32_t residual_rank = 0;  ///< residual vectors, stored after those of the basis
  };
  struct BlockLayout {
    End row, column;           ///< equal for blocks on the diagonal
    std::uint64_t values = 0;  ///< index of S or of the entries, counted from the end of the bases;
                               ///< of a packed S the index of its first byte
    std::uint32_t first_row = kNotPacked;  ///< index of the RowFormat of the first row of S
  };

  /// The layout of the blocks of `storage`, which must be valid (check_hierarchical_storage).
  /// Throws Error if they hold more values than any memory, or if there is not one format for each
  /// row of packed coupling matrices.
  explicit HierarchicalLayout(const HierarchicalStorage& storage);

  /// The index of one basis value: vector `rank` of one end of a low-rank block, at `position`
  /// counted from the beginning of its cluster.
  std::uint64_t basis_index(const End& end, std::uint64_t rank, std::uint64_t position) const;

  std::vector<Cluster> clusters;           ///< by begin, then by descending size
  std::vector<BlockLayout> block_layouts;  ///< one for each block
  std::uint64_t basis_value_count = 0;
  std::uint64_t coupling_value_count = 0;  ///< of coupling matrices and dense blocks; without
                                           ///< packed ones
  std::uint64_t packed_bytes = 0;          ///< of packed coupling matrices
  std::uint32_t packed_row_count = 0;
  std::uint32_t coefficient_count = 0;
  std::size_t largest_scratch = 0;  ///< the largest scratch_size() of all coupling matrices
  std::uint32_t rank_group;  ///< ranks that are interleaved: kRankGroup for integers, otherwise 1
  std::uint32_t cluster_coefficient_count = 0;

  /// The size of an array of `value_count` values with its padding.
  static std::uint64_t padded(std::uint64_t value_count);
  /// The size of the array of packed coupling matrices. Kernels read up to 32 bytes at once.
  static std::uint64_t padded_packed(std::uint64_t bytes);

 private:
  std::uint64_t filled_rank(const Cluster& cluster) const;
  void find_clusters(std::span<const TransferBlock> blocks);
  std::uint32_t cluster_at(std::uint32_t begin, std::uint32_t size) const;
  void place_bases(std::span<const TransferBlock> blocks, BasisPrecision precision);
  void place_couplings(const HierarchicalStorage& storage);
  void place_packed(const HierarchicalStorage& storage, const TransferBlock& block,
                    BlockLayout& block_layout);
};

/// Whether a block has values: it is dense or its rank is above zero.
bool has_values(const TransferBlock& block);

inline bool is_cluster_basis(const TransferBlock& block) {
  return block.kind == TransferBlock::Kind::kClusterBasis;
}

}  // namespace rebounce
