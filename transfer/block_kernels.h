#pragma once

#include <cstddef>
#include <cstdint>

namespace rebounce {

/// Products with the parts of a block of the hierarchical operator, for one instruction set.
///
/// Vectors of the three channels are planar: channel c begins at c times a stride. Sizes of vectors
/// over patches are multiples of HierarchicalOperator::kAlignment; ranks are anything.
template <typename Value>
struct BlockKernels {
  /// coefficient[c][r] = sum over k of basis[r][k] x[c][k], basis [rank][size].
  void (*project)(const Value* basis, std::size_t rank, std::size_t size, const float* x,
                  std::size_t stride, float* coefficient, std::size_t rank_stride);

  /// y[c][k] += sum over r of basis[r][k] coefficient[c][r].
  void (*expand)(const Value* basis, std::size_t rank, std::size_t size, const float* coefficient,
                 std::size_t rank_stride, float* y, std::size_t stride);

  /// row_out = S column_in and column_out = S^T row_in for the core S [rows][columns], read once.
  /// All have room for whole vectors; column_in is zero beyond `columns`.
  void (*core)(const Value* core, std::size_t rows, std::size_t columns, const float* column_in,
               const float* row_in, float* row_out, float* column_out);

  /// y_row += D x_column and y_column += D^T x_row for the block D [rows][columns], read once.
  void (*dense)(const Value* block, std::size_t rows, std::size_t columns, const float* x_column,
                const float* x_row, float* y_row, float* y_column);

  /// y_row += D x_column.
  void (*dense_diagonal)(const Value* block, std::size_t size, const float* x_column, float* y_row);
};

struct BlockKernelSet {
  const char* instruction_set;
  BlockKernels<float> f32;
  BlockKernels<std::uint16_t> f16;
};

extern const BlockKernelSet kBlockKernelsPortable;
extern const BlockKernelSet kBlockKernelsAvx2;
extern const BlockKernelSet kBlockKernelsAvx512;

/// The widest kernels that this processor runs.
const BlockKernelSet& block_kernels();

}  // namespace rebounce
