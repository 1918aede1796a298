#pragma once

// The block kernels, written once over a vector type `V` (vector_load.h). Included by one file per
// instruction set; everything is in an unnamed namespace so that no two sets share an
// instantiation.
//
// Twelve sums are kept in registers wherever possible: enough to hide the latency of the
// multiply-adds, and as many as AVX2 has room for. A value that was loaded and widened serves the
// three channels of a light, and of two lights where the registers suffice.

#include <cstddef>
#include <cstdint>

#include "block_kernels.h"
#include "rebounce/transfer/types.h"
#include "vector_load.h"

namespace rebounce {
namespace {

constexpr std::size_t kChannels = kChannelCount;

/// Calls work.template operator()<vectors>(first) for groups of vectors: the channels of two
/// lights where V has room for their sums, else of one.
template <typename V, typename Work>
inline void for_each_group(std::size_t vector_count, const Work& work) {
  std::size_t v = 0;
  if constexpr (V::kLights == 2) {
    for (; v + 2 * kChannels <= vector_count; v += 2 * kChannels) {
      work.template operator()<2 * kChannels>(v);
    }
  }
  for (; v < vector_count; v += kChannels) work.template operator()<kChannels>(v);
}

/// Stores the sums over the lanes of kCount vectors, four at most.
template <std::size_t kCount, typename V>
inline void store_sums(const V (&sum)[kCount], float* out) {
  if constexpr (kCount == 4) {
    V::store_sums(sum[0], sum[1], sum[2], sum[3], out);
  } else if constexpr (kCount == 1) {
    out[0] = sum[0].sum();
  } else {
    float four[4];
    V::store_sums(sum[0], sum[1], sum[kCount - 1], V::zero(), four);
    for (std::size_t r = 0; r < kCount; ++r) out[r] = four[r];
  }
}

/// Calls work.template operator()<rows>(first) for groups of four rows, and for what is left.
template <typename Work>
inline void for_each_four(std::size_t rows, const Work& work) {
  std::size_t r = 0;
  for (; r + 4 <= rows; r += 4) work.template operator()<4>(r);
  switch (rows - r) {
    case 3:
      return work.template operator()<3>(r);
    case 2:
      return work.template operator()<2>(r);
    case 1:
      return work.template operator()<1>(r);
    default:
      return;
  }
}

template <typename V, std::size_t kRows, std::size_t kVectors, typename Value>
inline void project_rows(const Value* basis, std::size_t size, const float* x, std::size_t x_stride,
                         float* coefficient, std::size_t stride) {
  V sum[kVectors][kRows];
  for (auto& rows : sum) {
    for (V& s : rows) s = V::zero();
  }
  for (std::size_t k = 0; k < size; k += V::kWidth) {
    V b[kRows];
    for (std::size_t r = 0; r < kRows; ++r) b[r] = load_values<V>(basis + r * size + k);
    for (std::size_t v = 0; v < kVectors; ++v) {
      const V xv = V::load(x + v * x_stride + k);
      for (std::size_t r = 0; r < kRows; ++r) sum[v][r] = multiply_add(b[r], xv, sum[v][r]);
    }
  }
  for (std::size_t v = 0; v < kVectors; ++v) store_sums(sum[v], coefficient + v * stride);
}

template <typename V, typename Value>
void project(const Value* basis, std::size_t rank, std::size_t size, PlanarVectors<const float> x,
             PlanarVectors<float> coefficient) {
  for_each_four(rank, [&]<std::size_t kRows>(std::size_t r) {
    for_each_group<V>(x.count, [&]<std::size_t kVectors>(std::size_t v) {
      project_rows<V, kRows, kVectors>(basis + r * size, size, x.data + v * x.stride, x.stride,
                                       coefficient.data + v * coefficient.stride + r,
                                       coefficient.stride);
    });
  });
}

/// y of kSize positions; ranks are dealt out among kSplit sums, so that there are twelve or more.
template <typename V, std::size_t kSize, std::size_t kVectors, typename Value>
inline void expand_strip(const Value* basis, std::size_t rank, std::size_t size,
                         const float* coefficient, std::size_t stride, float* y,
                         std::size_t y_stride) {
  constexpr std::size_t kWide = kSize / V::kWidth;
  constexpr std::size_t kSums = kVectors * kWide;
  constexpr std::size_t kSplit = kSums < 12 ? 12 / kSums : 1;
  V sum[kSplit][kVectors][kWide];
  for (auto& part : sum) {
    for (auto& vector : part) {
      for (V& s : vector) s = V::zero();
    }
  }
  const auto add_rank = [&](std::size_t r, V(&part)[kVectors][kWide]) {
    V b[kWide];
    for (std::size_t k = 0; k < kWide; ++k) {
      b[k] = load_values<V>(basis + r * size + k * V::kWidth);
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
      const V c = V::broadcast(coefficient[v * stride + r]);
      for (std::size_t k = 0; k < kWide; ++k) part[v][k] = multiply_add(b[k], c, part[v][k]);
    }
  };
  std::size_t r = 0;
  for (; r + kSplit <= rank; r += kSplit) {
    for (std::size_t s = 0; s < kSplit; ++s) add_rank(r + s, sum[s]);
  }
  for (; r < rank; ++r) add_rank(r, sum[0]);
  for (std::size_t v = 0; v < kVectors; ++v) {
    for (std::size_t k = 0; k < kWide; ++k) {
      float* const out = y + v * y_stride + k * V::kWidth;
      V total = V::load(out);
      for (std::size_t s = 0; s < kSplit; ++s) total = add(total, sum[s][v][k]);
      total.store(out);
    }
  }
}

template <typename V, typename Value>
void expand(const Value* basis, std::size_t rank, std::size_t size, std::size_t count,
            PlanarVectors<const float> coefficient, PlanarVectors<float> y) {
  for_each_group<V>(y.count, [&]<std::size_t kVectors>(std::size_t v) {
    const float* c = coefficient.data + v * coefficient.stride;
    float* yv = y.data + v * y.stride;
    std::size_t k = 0;
    for (; k + V::kStrip <= count; k += V::kStrip) {
      expand_strip<V, V::kStrip, kVectors>(basis + k, rank, size, c, coefficient.stride, yv + k,
                                           y.stride);
    }
    for (; k < count; k += 16) {
      expand_strip<V, 16, kVectors>(basis + k, rank, size, c, coefficient.stride, yv + k, y.stride);
    }
  });
}

/// Columns [begin, begin + width) of S, width at most that of V, for kLights vectors. Lanes beyond
/// them read on into the next row: column_in is zero there, and column_out is not stored.
template <typename V, bool kToRows, bool kToColumns, std::size_t kLights, typename Value>
inline void multiply_columns(const Value* s, std::size_t rows, std::size_t columns,
                             std::size_t begin, const CoreVectors& vectors, std::size_t first) {
  const std::size_t width = columns - begin < V::kWidth ? columns - begin : V::kWidth;
  V column_in[kLights], column_out[kLights];
  for (std::size_t l = 0; l < kLights; ++l) {
    column_out[l] = V::zero();
    if constexpr (kToRows) {
      column_in[l] = V::load_some(
          vectors.column_in.data + (first + l) * vectors.column_in.stride + begin, width);
    }
  }
  for_each_four(rows, [&]<std::size_t kRows>(std::size_t i) {
    V b[kRows];
    for (std::size_t r = 0; r < kRows; ++r) {
      b[r] = load_values<V>(s + (i + r) * columns + begin);
    }
    for (std::size_t l = 0; l < kLights; ++l) {
      if constexpr (kToColumns) {
        const float* in = vectors.row_in.data + (first + l) * vectors.row_in.stride + i;
        for (std::size_t r = 0; r < kRows; ++r) {
          column_out[l] = multiply_add(b[r], V::broadcast(in[r]), column_out[l]);
        }
      }
      if constexpr (kToRows) {
        V product[kRows];
        for (std::size_t r = 0; r < kRows; ++r) product[r] = multiply(b[r], column_in[l]);
        float sum[kRows];
        store_sums(product, sum);
        float* out = vectors.row_out.data + (first + l) * vectors.row_out.stride + i;
        for (std::size_t r = 0; r < kRows; ++r) out[r] = begin == 0 ? sum[r] : out[r] + sum[r];
      }
    }
  });
  if constexpr (kToColumns) {
    for (std::size_t l = 0; l < kLights; ++l) {
      column_out[l].store_some(
          vectors.column_out.data + (first + l) * vectors.column_out.stride + begin, width);
    }
  }
}

template <typename V, bool kToRows, bool kToColumns, typename Value>
void multiply_core(const Value* s, std::size_t rows, std::size_t columns,
                   const CoreVectors& vectors) {
  for (std::size_t j = 0; j < columns; j += V::kWidth) {
    std::size_t l = 0;
    for (; l + 2 <= vectors.row_in.count; l += 2) {
      multiply_columns<V, kToRows, kToColumns, 2>(s, rows, columns, j, vectors, l);
    }
    if (l < vectors.row_in.count) {
      multiply_columns<V, kToRows, kToColumns, 1>(s, rows, columns, j, vectors, l);
    }
  }
}

template <typename V, typename Value>
constexpr BasisKernels<Value> make_basis_kernels() {
  return {project<V, Value>, expand<V, Value>};
}

template <typename V, typename Value>
constexpr CoreKernels<Value> make_core_kernels() {
  return {multiply_core<V, true, true, Value>, multiply_core<V, true, false, Value>,
          multiply_core<V, false, true, Value>};
}

template <typename V>
constexpr BlockKernelSet make_block_kernels(const char* instruction_set) {
  return {instruction_set,
          make_basis_kernels<V, float>(),
          make_basis_kernels<V, std::uint16_t>(),
          make_basis_kernels<V, std::int8_t>(),
          make_core_kernels<V, float>(),
          make_core_kernels<V, std::uint16_t>()};
}

}  // namespace
}  // namespace rebounce
