#pragma once

// Products with dense blocks of an operator with one matrix, on light by position in planar order.
// A block is multiplied like a basis: S x as in a projection, S^T x as in an expansion. Written
// once over a vector type `V` (vector_load.h), like basis_kernels_impl.h.

#include <cstddef>
#include <span>

#include "rebounce/types.h"
#include "transfer/kernels/basis_kernels_impl.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

/// The output of a dense block for one light.
struct DenseOutput {
  PlanarVectors<float> rows, columns;
  float scale;
};

template <Output kOutput, typename Sums>
REBOUNCE_INLINE inline void put(const Sums& sums, float* to, float scale) {
  if constexpr (kOutput == Output::kSet) {
    sums.store(to);
  } else {
    sums.add_to(to, scale);
  }
}

/// Writes the sums over the columns, for as many rows at a time as V has lanes. multiply(r, sum)
/// computes four rows from r on, with the lanes not yet summed.
template <typename V, Output kOutput, typename Multiply>
REBOUNCE_INLINE inline void put_row_sums(const Multiply& multiply, std::size_t row_count,
                                         const DenseOutput& out) {
  constexpr std::size_t kRows = 4;
  const auto place = [&](std::size_t c, std::size_t r) {
    return out.rows.data + c * out.rows.stride + r;
  };
  for (std::size_t r = 0; r < row_count;) {
    V sum[kChannels][kRows];
    if constexpr (V::kWidth == 16) {
      alignas(64) float fours[kChannels][4][V::kWidth];
      for (std::size_t g = 0; g < 4; ++g, r += kRows) {
        multiply(r, sum);
        unroll<kChannels>([&](auto c)
                              REBOUNCE_INLINE { V::sums_in_fours(sum[c]).store(fours[c][g]); });
      }
      unroll<kChannels>([&](auto c) REBOUNCE_INLINE {
        const V four[4] = {V::load(fours[c][0]), V::load(fours[c][1]), V::load(fours[c][2]),
                           V::load(fours[c][3])};
        put<kOutput>(V::sums_of_fours(four), place(c, r - V::kWidth), out.scale);
      });
    } else {
      multiply(r, sum);
      unroll<kChannels>(
          [&](auto c) REBOUNCE_INLINE { put<kOutput>(sums_of(sum[c]), place(c, r), out.scale); });
      r += kRows;
    }
  }
}

/// Multiplies in both directions at once, for blocks so narrow that the sums over rows fit
/// registers.
template <typename V, std::size_t kWide, Output kOutput, typename Value>
REBOUNCE_INLINE inline void multiply_narrow_block(const Value* values, const DenseBlock& block,
                                                  PlanarVectors<const float> x,
                                                  const DenseOutput& out) {
  constexpr std::size_t kColumns = kWide * V::kWidth, kRows = 4;
  const float* const row_x = x.data + block.row_position;
  const float* const column_x = x.data + block.column_position;
  V to_columns[kChannels][kWide];
  unroll<kChannels>([&](auto c) REBOUNCE_INLINE {
    unroll<kWide>([&](auto w) REBOUNCE_INLINE { to_columns[c][w] = V::zero(); });
  });
  const auto multiply = [&](std::size_t row, V(&sum)[kChannels][kRows]) REBOUNCE_INLINE {
    unroll<kChannels>([&](auto c) REBOUNCE_INLINE {
      unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[c][r] = V::zero(); });
    });
    unroll<kWide>([&](auto w) REBOUNCE_INLINE {
      V b[kRows];
      unroll<kRows>([&](auto r) REBOUNCE_INLINE {
        b[r] = load_ahead<V>(values + (row + r) * kColumns + w * V::kWidth);
      });
      unroll<kChannels>([&](auto c) REBOUNCE_INLINE {
        const V xc = V::load(column_x + c * x.stride + w * V::kWidth);
        unroll<kRows>([&](auto r) REBOUNCE_INLINE {
          sum[c][r] = multiply_add(b[r], xc, sum[c][r]);
          to_columns[c][w] =
              multiply_add(b[r], V::broadcast(row_x[c * x.stride + row + r]), to_columns[c][w]);
        });
      });
    });
  };
  put_row_sums<V, kOutput>(multiply, block.rows, out);
  unroll<kChannels>([&](auto c) REBOUNCE_INLINE {
    unroll<kWide>([&](auto w) REBOUNCE_INLINE {
      put<kOutput>(to_columns[c][w], out.columns.data + c * out.columns.stride + w * V::kWidth,
                   out.scale);
    });
  });
}

/// Multiplies a block for one light: sums over columns as in a projection, then sums over rows as
/// in an expansion. The second pass reads the block from the first-level cache.
template <typename V, Output kOutput, typename Value>
REBOUNCE_INLINE inline void multiply_dense_block(const Value* values, const DenseBlock& block,
                                                 PlanarVectors<const float> x,
                                                 const DenseOutput& out) {
  if constexpr (V::kWidth == 16) {
    if (block.direction == DenseBlock::Direction::kBoth && block.columns == 16) {
      return multiply_narrow_block<V, 1, kOutput>(values, block, x, out);
    }
    if (block.direction == DenseBlock::Direction::kBoth && block.columns == 32) {
      return multiply_narrow_block<V, 2, kOutput>(values, block, x, out);
    }
  }
  if (block.direction != DenseBlock::Direction::kToColumns) {
    const auto multiply = [&](std::size_t r, V(&sum)[kChannels][4]) REBOUNCE_INLINE {
      multiply_rows<V, 4, kChannels>(values + r * block.columns, block.columns,
                                     x.data + block.column_position, x.stride, sum);
    };
    put_row_sums<V, kOutput>(multiply, block.rows, out);
  }
  if (block.direction != DenseBlock::Direction::kToRows) {
    const float* const from = x.data + block.row_position;
    const auto at = [&](std::size_t c, std::size_t r)
                        REBOUNCE_INLINE { return from + c * x.stride + r; };
    expand_strips<V, kChannels, kOutput>(values, block.rows, block.columns, at, 0, block.columns,
                                         out.columns.data, out.columns.stride, out.scale);
  }
}

template <typename V, typename Value>
void multiply_dense(const Value* values, std::span<const DenseBlock> blocks,
                    PlanarVectors<const float> x, Coefficients<float> out) {
  for (const DenseBlock& block : blocks) {
    for (std::size_t l = 0; l < x.count / kChannels; ++l) {
      float* const of_light = out.data + l * out.stride;
      const DenseOutput output{
          {of_light + std::size_t{block.row_out} * kChannelLanes, block.rows, kChannels},
          {of_light + std::size_t{block.column_out} * kChannelLanes, block.columns, kChannels},
          1};
      multiply_dense_block<V, Output::kSet>(
          values + block.values, block, {x.data + l * kChannels * x.stride, x.stride, kChannels},
          output);
    }
  }
}

template <typename V>
void add_products(std::span<const DenseEnd> ends, Coefficients<const float> products, float scale,
                  PlanarVectors<float> y) {
  const V factor = V::broadcast(scale);
  for (const DenseEnd& end : ends) {
    for (std::size_t v = 0; v < y.count; ++v) {
      const float* const from = products.data + v / kChannels * products.stride +
                                std::size_t{end.coefficient} * kChannelLanes +
                                v % kChannels * end.size + end.first;
      float* const to = y.data + v * y.stride + end.position;
      for (std::size_t k = 0; k < end.count; k += V::kWidth) {
        multiply_add(factor, V::load(from + k), V::load(to + k)).store(to + k);
      }
    }
  }
}

template <typename V, typename Value>
void add_dense(const Value* values, std::span<const DenseBlock> blocks,
               PlanarVectors<const float> x, float scale, PlanarVectors<float> y) {
  for (const DenseBlock& block : blocks) {
    const DenseOutput output{{y.data + block.row_position, y.stride, kChannels},
                             {y.data + block.column_position, y.stride, kChannels},
                             scale};
    multiply_dense_block<V, Output::kAddScaled>(values + block.values, block, x, output);
  }
}

}  // namespace
}  // namespace rebounce
