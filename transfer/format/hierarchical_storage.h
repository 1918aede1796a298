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
///   moments   W^T [row_rank][row_count]
/// In 8 bits U^T, V^T and W^T have row_remainders and column_remainders rows more. The constants
/// are those of HierarchicalFormat.
struct HierarchicalStorage {
  enum class Order : std::uint8_t {
    /// Block by block, U^T V^T S or the entries, without holes, then kPadding values not used.
    kByBlock,
    /// First the bases by cluster (begin ascending, then size descending), those of a cluster in
    /// the order of their blocks, U^T before V^T; then cores and dense entries by block, the
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
  std::vector<float> moment_scale;  ///< [moments] times W^T x is a moment of light x
  /// [n] by position, R = 2^this, within +-kLargestExponent; none: R = 1.
  std::vector<std::int8_t> scale_exponent;
  PatchRoles roles;  ///< by patch; entries that no source and receiver share are of no meaning
  Order order = Order::kByBlock;  ///< of the values
  Precision precision = Precision::kF32;
  SharedArray<float> values_f32;          ///< if kF32
  SharedArray<std::uint16_t> values_f16;  ///< IEEE half-precision bits, if kF16
  SharedArray<std::int16_t> bases_q16;    ///< if kQ16; values_f16 then holds the others alone
  SharedArray<std::int8_t> bases_q8;      ///< if kQ8; likewise

  /// R at a position that holds a patch.
  float position_scale(std::size_t position) const {
    return scale_exponent.empty() ? 1 : std::ldexp(1.0F, scale_exponent[position]);
  }
};

}  // namespace rebounce
