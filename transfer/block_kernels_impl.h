#pragma once

// The block kernels, written once over a vector type `V` (vector_load.h). Included by one file per
// instruction set; everything is in an unnamed namespace so that no two sets share an
// instantiation.

#include <cstddef>
#include <cstdint>

#include "block_kernels.h"
#include "rebounce/transfer/types.h"
#include "vector_load.h"

namespace rebounce {
namespace {

// Basis vectors that are worked on together: with three channels each, their sums fill the
// registers of AVX2.
constexpr std::size_t kGroup = 4;

template <typename V, std::size_t kCount, typename Value>
void project_group(const Value* basis, std::size_t size, const float* x, std::size_t stride,
                   float* coefficient, std::size_t rank_stride) {
  V sum[kChannelCount][kCount];
  for (auto& channel : sum) {
    for (V& s : channel) s = V::zero();
  }
  for (std::size_t k = 0; k < size; k += V::kWidth) {
    V xc[kChannelCount];
    for (int c = 0; c < kChannelCount; ++c) xc[c] = V::load(x + c * stride + k);
    for (std::size_t r = 0; r < kCount; ++r) {
      const V b = load_values<V>(basis + r * size + k);
      for (int c = 0; c < kChannelCount; ++c) sum[c][r] = multiply_add(b, xc[c], sum[c][r]);
    }
  }
  for (int c = 0; c < kChannelCount; ++c) {
    for (std::size_t r = 0; r < kCount; ++r) coefficient[c * rank_stride + r] = sum[c][r].sum();
  }
}

template <typename V, std::size_t kCount, typename Value>
void expand_group(const Value* basis, std::size_t size, const float* coefficient,
                  std::size_t rank_stride, float* y, std::size_t stride) {
  V scale[kChannelCount][kCount];
  for (int c = 0; c < kChannelCount; ++c) {
    for (std::size_t r = 0; r < kCount; ++r) {
      scale[c][r] = V::broadcast(coefficient[c * rank_stride + r]);
    }
  }
  for (std::size_t k = 0; k < size; k += V::kWidth) {
    V yc[kChannelCount];
    for (int c = 0; c < kChannelCount; ++c) yc[c] = V::load(y + c * stride + k);
    for (std::size_t r = 0; r < kCount; ++r) {
      const V b = load_values<V>(basis + r * size + k);
      for (int c = 0; c < kChannelCount; ++c) yc[c] = multiply_add(b, scale[c][r], yc[c]);
    }
    for (int c = 0; c < kChannelCount; ++c) yc[c].store(y + c * stride + k);
  }
}

template <typename V, typename Value>
void project(const Value* basis, std::size_t rank, std::size_t size, const float* x,
             std::size_t stride, float* coefficient, std::size_t rank_stride) {
  std::size_t r = 0;
  for (; r + kGroup <= rank; r += kGroup) {
    project_group<V, kGroup>(basis + r * size, size, x, stride, coefficient + r, rank_stride);
  }
  for (; r < rank; ++r) {
    project_group<V, 1>(basis + r * size, size, x, stride, coefficient + r, rank_stride);
  }
}

template <typename V, typename Value>
void expand(const Value* basis, std::size_t rank, std::size_t size, const float* coefficient,
            std::size_t rank_stride, float* y, std::size_t stride) {
  std::size_t r = 0;
  for (; r + kGroup <= rank; r += kGroup) {
    expand_group<V, kGroup>(basis + r * size, size, coefficient + r, rank_stride, y, stride);
  }
  for (; r < rank; ++r) {
    expand_group<V, 1>(basis + r * size, size, coefficient + r, rank_stride, y, stride);
  }
}

// Whole vectors at the end of a row run on into the next one: there column_in is zero, and what
// column_out gets is never read.
template <typename V, typename Value>
void multiply_core(const Value* core, std::size_t rows, std::size_t columns, const float* column_in,
                   const float* row_in, float* row_out, float* column_out) {
  for (std::size_t j = 0; j < columns; j += V::kWidth) V::zero().store(column_out + j);
  for (std::size_t i = 0; i < rows; ++i) {
    const V row = V::broadcast(row_in[i]);
    V sum = V::zero();
    for (std::size_t j = 0; j < columns; j += V::kWidth) {
      const V s = load_values<V>(core + i * columns + j);
      sum = multiply_add(s, V::load(column_in + j), sum);
      multiply_add(s, row, V::load(column_out + j)).store(column_out + j);
    }
    row_out[i] = sum.sum();
  }
}

template <typename V, std::size_t kStrip, typename Value>
void multiply_strip(const Value* block, std::size_t rows, std::size_t columns,
                    const float* x_column, const float* x_row, float* y_row, float* y_column) {
  constexpr std::size_t kVectors = kStrip / V::kWidth;
  V y[kVectors];
  for (std::size_t k = 0; k < kVectors; ++k) y[k] = V::load(y_column + k * V::kWidth);
  for (std::size_t i = 0; i < rows; ++i) {
    const V x = V::broadcast(x_row[i]);
    V sum = V::zero();
    for (std::size_t k = 0; k < kVectors; ++k) {
      const V b = load_values<V>(block + i * columns + k * V::kWidth);
      sum = multiply_add(b, V::load(x_column + k * V::kWidth), sum);
      y[k] = multiply_add(b, x, y[k]);
    }
    y_row[i] += sum.sum();
  }
  for (std::size_t k = 0; k < kVectors; ++k) y[k].store(y_column + k * V::kWidth);
}

template <typename V, typename Value>
void multiply_dense(const Value* block, std::size_t rows, std::size_t columns,
                    const float* x_column, const float* x_row, float* y_row, float* y_column) {
  std::size_t j = 0;
  for (; j + 32 <= columns; j += 32) {
    multiply_strip<V, 32>(block + j, rows, columns, x_column + j, x_row, y_row, y_column + j);
  }
  for (; j < columns; j += 16) {
    multiply_strip<V, 16>(block + j, rows, columns, x_column + j, x_row, y_row, y_column + j);
  }
}

template <typename V, typename Value>
void multiply_dense_diagonal(const Value* block, std::size_t size, const float* x_column,
                             float* y_row) {
  for (std::size_t i = 0; i < size; ++i) {
    V sum = V::zero();
    for (std::size_t j = 0; j < size; j += V::kWidth) {
      sum = multiply_add(load_values<V>(block + i * size + j), V::load(x_column + j), sum);
    }
    y_row[i] += sum.sum();
  }
}

template <typename V, typename Value>
constexpr BlockKernels<Value> make_block_kernels_of() {
  return {project<V, Value>, expand<V, Value>, multiply_core<V, Value>, multiply_dense<V, Value>,
          multiply_dense_diagonal<V, Value>};
}

template <typename V>
constexpr BlockKernelSet make_block_kernels(const char* instruction_set) {
  return {instruction_set, make_block_kernels_of<V, float>(),
          make_block_kernels_of<V, std::uint16_t>()};
}

}  // namespace
}  // namespace rebounce
