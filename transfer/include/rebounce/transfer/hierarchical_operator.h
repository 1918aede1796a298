#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/shared_array.h"
#include "rebounce/transfer/transfer_operator.h"

namespace rebounce {

template <typename Value>
struct BlockKernels;

/// A rectangle of the symmetric matrix Yhat in cluster order. Either it lies on the diagonal, its
/// rows and columns the same, or all of its columns come before its rows; then it stands for its
/// transpose too.
struct TransferBlock {
  enum class Kind : std::uint32_t { kDense = 0, kLowRank = 1 };

  std::uint32_t row_begin = 0, row_count = 0;        ///< positions, multiples of kAlignment
  std::uint32_t column_begin = 0, column_count = 0;  ///< likewise
  Kind kind = Kind::kDense;
  std::uint32_t row_rank = 0, column_rank = 0;  ///< of a low-rank block, 0 for a dense one
  std::uint64_t offset = 0;                     ///< of its first value

  bool on_diagonal() const { return row_begin == column_begin; }

  /// Values that it takes up, for `matrix_count` distinct channels.
  std::uint64_t value_count(std::uint32_t matrix_count) const;
};

/// Y as a hierarchical matrix (W. Hackbusch, "Hierarchical Matrices", 2015): the symmetric form
/// Yhat = A^1/2 Y A^-1/2, its patches in an order that keeps neighbours together, cut into blocks
/// that are dense or of low rank. Of a block and its mirror image one is stored and applied twice.
///
/// The channels share the bases of a low-rank block and have a core each: B_c = U S_c V^T, on the
/// diagonal B_c = U S_c U^T. Values of a block, one after the other:
///   dense     [matrix][row_count][column_count]
///   low-rank  U^T [row_rank][row_count], V^T [column_rank][column_count] (not on the diagonal),
///             S [matrix][row_rank][column_rank]
/// Blocks follow each other without holes in the order of traversal; kPadding values that are not
/// used end the buffer, so that kernels may read whole vectors.
class HierarchicalOperator final : public TransferOperator {
 public:
  /// Clusters begin and end at multiples of this many positions.
  static constexpr std::size_t kAlignment = 16;
  static constexpr std::size_t kPadding = 16;

  /// In half precision, dense entries and cores are stored times this, so that small ones stay
  /// normal numbers; bases are stored as they are.
  static constexpr float kHalfScale = DenseOperator::kHalfScale;

  struct Storage {
    std::vector<float> area;                                    ///< [n] m², by patch
    std::vector<std::uint32_t> patch;                           ///< [n] patch at each position
    std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix a channel uses
    std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
    std::vector<TransferBlock> blocks;                          ///< offsets are filled in
    Precision precision = Precision::kF32;
    SharedArray<float> values_f32;          ///< if kF32
    SharedArray<std::uint16_t> values_f16;  ///< IEEE half-precision bits, if kF16
  };

  /// Positions with the padding that makes them whole vectors: n rounded up to kAlignment.
  static std::size_t position_count(std::size_t patch_count);

  /// The same blocks with their values as half-precision numbers. Throws Error if one is beyond
  /// their range.
  static Storage encode_half(const Storage& storage);

  /// Takes over `storage`. Throws Error if `patch` is not a permutation, a block reaches outside
  /// the matrix, is misplaced or has a rank above its size, or the values do not fit the blocks.
  /// Whether the blocks cover the matrix is not looked at.
  explicit HierarchicalOperator(Storage storage);

  const Storage& storage() const { return storage_; }

  std::size_t patch_count() const override { return storage_.area.size(); }
  std::size_t bytes() const override;
  std::string kind() const override { return "hierarchical"; }
  std::size_t workspace_size() const override;
  void apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
             std::span<float> workspace) const override;
  void expand(int channel, std::span<float> transfer) const override;

 private:
  /// Consecutive blocks whose products are summed in a buffer of their own, and the positions that
  /// they add to.
  struct Slot {
    std::size_t first_block = 0, last_block = 0;
    std::size_t begin = 0, end = 0;
  };

  static std::vector<Slot> share_out(std::span<const TransferBlock> blocks,
                                     std::uint64_t value_count);
  template <typename Value>
  void apply_slots(const BlockKernels<Value>& kernels, const Value* values, const float* x,
                   float* slots) const;
  /// Adds up what the slots hold of one channel, in their order, into sum [positions].
  void add_slots(int channel, const float* slots, float* sum) const;
  std::size_t slot_size() const;

  Storage storage_;
  std::vector<float> sqrt_area_;  ///< [n] by position
  std::vector<Slot> slots_;
  std::size_t rank_stride_ = 0;  ///< the largest rank, rounded up to kAlignment
};

}  // namespace rebounce
