#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "transfer/base/precision.h"
#include "transfer/base/shared_array.h"
#include "transfer/base/types.h"
#include "transfer/data/patch_roles.h"
#include "transfer/format/operator_format.h"

namespace rebounce {

/// What a HierarchicalOperator is made of: tables and values. Values of a block:
///   dense     [matrix][row_count][column_count]
///   low-rank  U^T [row_rank][row_count], V^T [column_rank][column_count] (not on the diagonal),
///             S [matrix][row_rank][column_rank]
///   cluster coefficients   W^T [row_rank][row_count]
/// In 8 bits U^T, V^T and W^T have row_residual_rank and column_residual_rank rows more. The
/// constants are those of HierarchicalFormat.
struct HierarchicalStorage {
  enum class Order : std::uint8_t {
    /// Block by block, U^T V^T S or the entries, without holes, then kPadding values not used.
    kByBlock,
    /// First the bases by cluster (begin ascending, then size descending), those of a cluster in
    /// the order of their blocks, U^T before V^T; then coupling matrices and dense entries by
    /// block, the
    /// matrices of an entry side by side; zeros to the next multiple of 64 values, at least
    /// kPadding of them. Bases in an array of their own are followed by zeros likewise. Integers
    /// are [strip][rank / kRankGroup][position / 2][kRankGroup][2 positions] in each cluster:
    /// strips of kStrip positions or what is left of it, the last ranks filled up with zeros.
    kStreamed,
  };

  std::vector<float> area;                                    ///< [n] m², by patch
  std::vector<std::uint32_t> patch;                           ///< [n] patch at each position
  std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix a channel uses
  std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
  std::vector<TransferBlock> blocks;                          ///< where there is none, Yhat is 0
  std::vector<float> coefficient_scale;  ///< [cluster coefficients] times W^T x is a cluster
                                         ///< coefficient of light x
  /// [n] by position, R = 2^this, within +-kLargestExponent; none: R = 1.
  std::vector<std::int8_t> scale_exponent;
  PatchRoles roles;  ///< by patch; entries that no source and receiver share are of no meaning
  Order order = Order::kByBlock;  ///< of the values
  HierarchicalPrecision precision;
  /// Bases are in the array of their type, and so are coupling matrices and dense entries: after
  /// the bases if both are of one type. The other arrays are empty.
  SharedArray<float> values_f32;
  SharedArray<std::uint16_t> values_f16;  ///< IEEE half-precision bits
  SharedArray<std::int16_t> bases_q16;
  SharedArray<std::int8_t> bases_q8;

  /// Whether bases and coupling matrices are in one array.
  bool one_array() const;

  /// Where coupling matrices begin in their array, with bases of `basis_value_count` values.
  std::uint64_t first_coupling(std::uint64_t basis_value_count) const {
    return one_array() ? basis_value_count : 0;
  }

  /// R at a position that holds a patch.
  float position_scale(std::size_t position) const {
    return scale_exponent.empty() ? 1 : std::ldexp(1.0F, scale_exponent[position]);
  }
};

/// Returns work(array) with the array of `storage`, constant or not, that the bases are in.
template <typename Storage, typename Work>
decltype(auto) with_bases(Storage& storage, const Work& work) {
  switch (storage.precision.bases) {
    case BasisPrecision::kF16:
      return work(storage.values_f16);
    case BasisPrecision::kQ16:
      return work(storage.bases_q16);
    case BasisPrecision::kQ8:
      return work(storage.bases_q8);
    case BasisPrecision::kF32:
      break;
  }
  return work(storage.values_f32);
}

/// Likewise with that of coupling matrices and dense entries.
template <typename Storage, typename Work>
decltype(auto) with_couplings(Storage& storage, const Work& work) {
  switch (storage.precision.couplings) {
    case CouplingPrecision::kF16:
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
  work(storage.bases_q16);
  work(storage.bases_q8);
}

inline bool HierarchicalStorage::one_array() const {
  const auto address = [](const auto& array) -> const void* { return &array; };
  return with_bases(*this, address) == with_couplings(*this, address);
}

}  // namespace rebounce
