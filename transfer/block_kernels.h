#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rebounce/transfer/types.h"

namespace rebounce {

/// Vectors that are worked on together, planar: vector v begins at v times `stride`. Three for each
/// light, its channels.
template <typename T>
struct PlanarVectors {
  T* data;
  std::size_t stride, count;
};

/// Products with the bases of the hierarchical operator, for one instruction set. Counts of
/// positions are multiples of HierarchicalOperator::kAlignment; ranks are anything. An int8_t
/// stands for itself: its scale is elsewhere.
template <typename Value>
struct BasisKernels {
  /// coefficient[v][r] = sum over k of basis[r][k] x[v][k], basis [rank][size].
  void (*project)(const Value* basis, std::size_t rank, std::size_t size,
                  PlanarVectors<const float> x, PlanarVectors<float> coefficient);

  /// y[v][k] += sum over r of basis[r][k] coefficient[v][r] for `count` columns of a basis
  /// [rank][size].
  void (*expand)(const Value* basis, std::size_t rank, std::size_t size, std::size_t count,
                 PlanarVectors<const float> coefficient, PlanarVectors<float> y);
};

/// The cores or the entries of a block, S [matrix][rows][columns] of any size; whole vectors are
/// read at the end of each.
template <typename Value>
struct CoreMatrices {
  const Value* data;
  std::size_t rows, columns;
  std::array<std::uint32_t, kChannelCount> channel_matrix;
};

/// What goes into the cores and what comes out, in the same order of channels and lights.
struct CoreVectors {
  PlanarVectors<const float> row_in, column_in;
  PlanarVectors<float> row_out, column_out;
};

/// Products with cores and dense blocks; what was there before is overwritten.
template <typename Value>
struct CoreKernels {
  using Product = void (*)(const CoreMatrices<Value>& s, const CoreVectors& vectors);
  Product both;        ///< row_out = S column_in and column_out = S^T row_in, S read once
  Product to_rows;     ///< row_out = S column_in
  Product to_columns;  ///< column_out = S^T row_in
};

struct BlockKernelSet {
  const char* instruction_set;
  BasisKernels<float> bases_f32;
  BasisKernels<std::uint16_t> bases_f16;
  BasisKernels<std::int8_t> bases_q8;
  CoreKernels<float> cores_f32;
  CoreKernels<std::uint16_t> cores_f16;
};

extern const BlockKernelSet kBlockKernelsPortable;
extern const BlockKernelSet kBlockKernelsAvx2;
extern const BlockKernelSet kBlockKernelsAvx512;

/// The widest kernels that this processor runs.
const BlockKernelSet& block_kernels();

}  // namespace rebounce
