#pragma once

#include <cstddef>
#include <cstdint>

namespace rebounce {

/// Products with one 64 x 64 row-major tile T of a symmetric matrix, for one instruction set.
///
/// off_diagonal: y_row += T x_column and y_column += T^T x_row; reads T once. diagonal: y_row += T
/// x_column.
///
/// All vectors have 64 entries. Half-precision tiles hold the entries times
/// DenseOperator::kHalfScale; the caller removes this factor from the product.
template <typename Value>
struct TileKernels {
  void (*off_diagonal)(const Value* tile, const float* x_column, const float* x_row, float* y_row,
                       float* y_column);
  void (*diagonal)(const Value* tile, const float* x_column, float* y_row);
};

struct DenseKernels {
  TileKernels<float> f32;
  TileKernels<std::uint16_t> f16;
};

}  // namespace rebounce
