#pragma once

// The tile kernels, written once over a vector type `V` (vector_load.h). One file per instruction
// set includes this. Everything is in an unnamed namespace, so that no two sets share an
// instantiation.

#include <cstddef>
#include <cstdint>

#include "transfer/format/operator_format.h"
#include "transfer/kernels/dense_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

template <typename V, typename Value>
void multiply_diagonal(const Value* tile, const float* x_column, float* y_row) {
  constexpr std::size_t kSize = kDenseTile;
  constexpr std::size_t kVectors = kSize / V::kWidth;
  for (std::size_t row = 0; row < kSize; ++row) {
    V sum = V::zero();
    for (std::size_t k = 0; k < kVectors; ++k) {
      const V t = load_values<V>(tile + row * kSize + k * V::kWidth);
      sum = multiply_add(t, V::load(x_column + k * V::kWidth), sum);
    }
    y_row[row] += sum.sum();
  }
}

template <typename V, typename Value>
void multiply_off_diagonal(const Value* tile, const float* x_column, const float* x_row,
                           float* y_row, float* y_column) {
  constexpr std::size_t kSize = kDenseTile;
  // Strips of eight vectors of columns, so that the y of a strip stays in registers.
  constexpr std::size_t kVectors = kSize / V::kWidth < 8 ? kSize / V::kWidth : 8;
  constexpr std::size_t kStrip = kVectors * V::kWidth;
  for (std::size_t begin = 0; begin < kSize; begin += kStrip) {
    V y[kVectors];
    for (std::size_t k = 0; k < kVectors; ++k) y[k] = V::load(y_column + begin + k * V::kWidth);
    for (std::size_t row = 0; row < kSize; ++row) {
      const V x = V::broadcast(x_row[row]);
      V sum = V::zero();
      for (std::size_t k = 0; k < kVectors; ++k) {
        const V t = load_values<V>(tile + row * kSize + begin + k * V::kWidth);
        sum = multiply_add(t, V::load(x_column + begin + k * V::kWidth), sum);
        y[k] = multiply_add(t, x, y[k]);
      }
      y_row[row] += sum.sum();
    }
    for (std::size_t k = 0; k < kVectors; ++k) y[k].store(y_column + begin + k * V::kWidth);
  }
}

template <typename V>
constexpr DenseKernels make_dense_kernels() {
  return {{multiply_off_diagonal<V, float>, multiply_diagonal<V, float>},
          {multiply_off_diagonal<V, std::uint16_t>, multiply_diagonal<V, std::uint16_t>}};
}

}  // namespace
}  // namespace rebounce
