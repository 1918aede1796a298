#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rebounce/scene_data.h"
#include "rebounce/types.h"
#include "transfer/base/precision.h"
#include "transfer/base/shared_array.h"
#include "transfer/format/operator_format.h"

namespace rebounce {

/// The tables and values of a HierarchicalOperator. A block has these values:
///
///   dense          [matrix][row_count][column_count]
///   low-rank       U^T [row_rank][row_count], V^T [column_rank][column_count],
///                  S [matrix][row_rank][column_rank]; no V^T on the diagonal
///   cluster basis  W^T [row_rank][row_count]
///
/// Beside integer bases, S has integers of 4 to 16 bits by row, [row_rank][column_rank][matrix].
/// In 8 bits U^T, V^T and W^T have row_residual_rank or column_residual_rank more rows. The
/// constants are in HierarchicalFormat.
struct HierarchicalStorage {
  enum class Order : std::uint8_t {
    /// Block after block, U^T V^T S or the entries, without gaps, then kPadding unused values.
    kByBlock,
    /// First the bases, cluster by cluster (by begin, then by descending size). Within a cluster
    /// they keep the order of their blocks, U^T before V^T. Then the coupling matrices and dense
    /// entries, block by block, with the values of all matrices for one entry next to each other.
    /// Zeros fill the array up to a multiple of 64 values, with at least kPadding of them. Bases in
    /// an array of their own are padded in the same way. Integers are [strip][rank /
    /// kRankGroup][position / kPositionGroup][kRankGroup][kPositionGroup] in each cluster. A strip
    /// has kStrip positions, the last one fewer; the last group of ranks is filled up with zeros.
    /// Packed coupling matrices follow each other block by block, row by row.
    kStreamed,
  };

  std::vector<float> area;                                    ///< [n] m², by patch
  std::vector<std::uint32_t> patch;                           ///< [n] patch at each position
  std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix each channel uses
  std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
  std::vector<TransferBlock> blocks;                          ///< where there is none, Yhat is 0
  std::vector<float> coefficient_scale;  ///< [cluster coefficients]; a cluster coefficient of light
                                         ///< x is this times W^T x
  /// [n] by position: R = 2^this, within +-kLargestExponent. Empty: R = 1.
  std::vector<std::int8_t> scale_exponent;
  /// [rows of all low-rank blocks with values] RowFormat of each row of a coupling matrix, block by
  /// block; empty unless coupling matrices are packed.
  std::vector<std::uint8_t> row_format;
  PatchRoles roles;  ///< by patch; entries that no receiver and source share are arbitrary
  Order order = Order::kByBlock;  ///< of the values
  HierarchicalPrecision precision;
  /// Bases are in the array of their type, and so are coupling matrices and dense entries. If both
  /// have the same type, the bases come first in one array. Packed coupling matrices have an array
  /// of their own; values_f16 then holds the dense entries. The other arrays are empty.
  SharedArray<float> values_f32;
  SharedArray<std::uint16_t> values_f16;  ///< bits of IEEE half-precision numbers
  SharedArray<std::int8_t> bases_q8;
  SharedArray<std::uint8_t> packed_couplings;

  /// Whether bases and coupling matrices share one array.
  bool one_array() const;

  bool has_packed_couplings() const { return precision.couplings == CouplingPrecision::kPacked; }

  /// The index of the first coupling value in its array; `basis_value_count`: number of basis
  /// values.
  std::uint64_t first_coupling(std::uint64_t basis_value_count) const {
    return one_array() ? basis_value_count : 0;
  }

  /// R at a position that holds a patch.
  float position_scale(std::size_t position) const {
    return scale_exponent.empty() ? 1 : std::ldexp(1.0F, scale_exponent[position]);
  }
};

/// Returns work(array), where `array` is the one that holds the bases; `storage` may be const.
template <typename Storage, typename Work>
decltype(auto) with_bases(Storage& storage, const Work& work) {
  switch (storage.precision.bases) {
    case BasisPrecision::kF16:
      return work(storage.values_f16);
    case BasisPrecision::kQ8:
      return work(storage.bases_q8);
    case BasisPrecision::kF32:
      break;
  }
  return work(storage.values_f32);
}

/// Returns work(array), where `array` is the one that holds dense entries, and coupling matrices
/// unless they are packed.
template <typename Storage, typename Work>
decltype(auto) with_couplings(Storage& storage, const Work& work) {
  switch (storage.precision.couplings) {
    case CouplingPrecision::kF16:
    case CouplingPrecision::kPacked:
      return work(storage.values_f16);
    case CouplingPrecision::kF32:
      break;
  }
  return work(storage.values_f32);
}

/// Calls work(array) for all arrays of values.
template <typename Storage, typename Work>
void for_each_array(Storage& storage, const Work& work) {
  work(storage.values_f32);
  work(storage.values_f16);
  work(storage.bases_q8);
  work(storage.packed_couplings);
}

inline bool HierarchicalStorage::one_array() const {
  const auto address = [](const auto& array) -> const void* { return &array; };
  return with_bases(*this, address) == with_couplings(*this, address);
}

}  // namespace rebounce
