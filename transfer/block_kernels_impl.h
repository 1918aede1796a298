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
REBOUNCE_INLINE inline void for_each_group(std::size_t vector_count, const Work& work) {
  std::size_t v = 0;
  if constexpr (V::kLights == 2) {
    for (; v + 2 * kChannels <= vector_count; v += 2 * kChannels) {
      work.template operator()<2 * kChannels>(v);
    }
  }
  for (; v < vector_count; v += kChannels) work.template operator()<kChannels>(v);
}

/// Calls work.template operator()<rows>(first) for groups of four rows, and for what is left.
template <typename Work>
REBOUNCE_INLINE inline void for_each_four(std::size_t rows, const Work& work) {
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

/// The sums over the lanes of kCount vectors, four at most, in the first lanes.
template <std::size_t kCount, typename V>
REBOUNCE_INLINE inline auto sums_of(const V (&sum)[kCount]) {
  if constexpr (kCount == 4) {
    return V::sums(sum[0], sum[1], sum[2], sum[3]);
  } else if constexpr (kCount == 3) {
    return V::sums(sum[0], sum[1], sum[2], V::zero());
  } else if constexpr (kCount == 2) {
    return V::sums(sum[0], sum[1], V::zero(), V::zero());
  } else {
    return V::sums(sum[0], V::zero(), V::zero(), V::zero());
  }
}

template <typename V, std::size_t kRows, std::size_t kVectors, typename Value>
REBOUNCE_INLINE inline void project_rows(const Value* basis, std::size_t size, const float* x,
                                         std::size_t x_stride, float* coefficient,
                                         std::size_t stride) {
  V sum[kVectors][kRows];
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[v][r] = V::zero(); });
  });
  for (std::size_t k = 0; k < size; k += V::kWidth) {
    V b[kRows];
    unroll<kRows>([&](auto r) REBOUNCE_INLINE { b[r] = load_values<V>(basis + r * size + k); });
    unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
      const V xv = V::load(x + v * x_stride + k);
      unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[v][r] = multiply_add(b[r], xv, sum[v][r]); });
    });
  }
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    store_first<kRows>(sums_of(sum[v]), coefficient + v * stride);
  });
}

template <typename V, typename Value>
void project(const Value* basis, std::size_t rank, std::size_t size, PlanarVectors<const float> x,
             PlanarVectors<float> coefficient) {
  for_each_four(rank, [&]<std::size_t kRows>(std::size_t r) REBOUNCE_INLINE {
    for_each_group<V>(x.count, [&]<std::size_t kVectors>(std::size_t v) REBOUNCE_INLINE {
      project_rows<V, kRows, kVectors>(basis + r * size, size, x.data + v * x.stride, x.stride,
                                       coefficient.data + v * coefficient.stride + r,
                                       coefficient.stride);
    });
  });
}

/// y of kSize positions; ranks are dealt out among kSplit sums, so that there are twelve of them or
/// more.
template <typename V, std::size_t kSize, std::size_t kVectors, typename Value>
REBOUNCE_INLINE inline void expand_strip(const Value* basis, std::size_t rank, std::size_t size,
                                         const float* coefficient, std::size_t stride, float* y,
                                         std::size_t y_stride) {
  constexpr std::size_t kWide = kSize / V::kWidth;
  constexpr std::size_t kSums = kVectors * kWide;
  constexpr std::size_t kSplit = kSums < 12 ? 12 / kSums : 1;
  V sum[kSplit][kVectors][kWide];
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kWide>([&](auto k) REBOUNCE_INLINE {
      sum[0][v][k] = V::load(y + v * y_stride + k * V::kWidth);
      unroll<kSplit - 1>([&](auto s) REBOUNCE_INLINE { sum[s + 1][v][k] = V::zero(); });
    });
  });
  const auto add_rank = [&](std::size_t r, auto s) REBOUNCE_INLINE {
    V b[kWide];
    unroll<kWide>([&](auto k)
                      REBOUNCE_INLINE { b[k] = load_values<V>(basis + r * size + k * V::kWidth); });
    unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
      const V c = V::broadcast(coefficient[v * stride + r]);
      unroll<kWide>([&](auto k)
                        REBOUNCE_INLINE { sum[s][v][k] = multiply_add(b[k], c, sum[s][v][k]); });
    });
  };
  std::size_t r = 0;
  for (; r + kSplit <= rank; r += kSplit) {
    unroll<kSplit>([&](auto s) REBOUNCE_INLINE { add_rank(r + s, s); });
  }
  for (; r < rank; ++r) add_rank(r, std::integral_constant<std::size_t, 0>{});
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kWide>([&](auto k) REBOUNCE_INLINE {
      V total = sum[0][v][k];
      unroll<kSplit - 1>([&](auto s) REBOUNCE_INLINE { total = add(total, sum[s + 1][v][k]); });
      total.store(y + v * y_stride + k * V::kWidth);
    });
  });
}

template <typename V, typename Value>
void expand(const Value* basis, std::size_t rank, std::size_t size, std::size_t count,
            PlanarVectors<const float> coefficient, PlanarVectors<float> y) {
  for_each_group<V>(y.count, [&]<std::size_t kVectors>(std::size_t v) REBOUNCE_INLINE {
    const float* c = coefficient.data + v * coefficient.stride;
    float* yv = y.data + v * y.stride;
    std::size_t k = 0;
    const auto add_strips = [&]<std::size_t kSize>() REBOUNCE_INLINE {
      for (; k + kSize <= count; k += kSize) {
        expand_strip<V, kSize, kVectors>(basis + k, rank, size, c, coefficient.stride, yv + k,
                                         y.stride);
      }
    };
    if constexpr (V::kStrip >= 64) add_strips.template operator()<64>();
    if constexpr (V::kStrip >= 32) add_strips.template operator()<32>();
    add_strips.template operator()<16>();
  });
}

/// Columns [begin, begin + width) of S [rows][columns], width at most that of V, for kLights
/// vectors. Lanes beyond them read on into the next row: column_in is zero there, and column_out is
/// not stored.
template <typename V, bool kToRows, bool kToColumns, std::size_t kLights, typename Value>
REBOUNCE_INLINE inline void multiply_columns(const Value* s, std::size_t rows, std::size_t columns,
                                             std::size_t begin, const CoreVectors& vectors,
                                             std::size_t first) {
  constexpr std::size_t kStep = kChannels;  // from a channel of one light to that of the next
  const std::size_t width = columns - begin < V::kWidth ? columns - begin : V::kWidth;
  const std::size_t in_stride = vectors.row_in.stride, out_stride = vectors.row_out.stride;
  const float* const row_in = vectors.row_in.data + first * in_stride;
  float* const row_out = vectors.row_out.data + first * out_stride;
  V column_in[kLights], column_out[kLights];
  unroll<kLights>([&](auto l) REBOUNCE_INLINE {
    column_out[l] = V::zero();
    if constexpr (kToRows) {
      column_in[l] =
          V::load_some(vectors.column_in.data + (first + kStep * l) * in_stride + begin, width);
    }
  });
  for_each_four(rows, [&]<std::size_t kRows>(std::size_t i) REBOUNCE_INLINE {
    V b[kRows];
    unroll<kRows>([&](auto r)
                      REBOUNCE_INLINE { b[r] = load_values<V>(s + (i + r) * columns + begin); });
    unroll<kLights>([&](auto l) REBOUNCE_INLINE {
      if constexpr (kToColumns) {
        unroll<kRows>([&](auto r) REBOUNCE_INLINE {
          const V in = V::broadcast(row_in[kStep * l * in_stride + i + r]);
          column_out[l] = multiply_add(b[r], in, column_out[l]);
        });
      }
      if constexpr (kToRows) {
        V product[kRows];
        unroll<kRows>([&](auto r) REBOUNCE_INLINE { product[r] = multiply(b[r], column_in[l]); });
        float* const out = row_out + kStep * l * out_stride + i;
        if (begin == 0) {
          store_first<kRows>(sums_of(product), out);
        } else {
          add_first<kRows>(sums_of(product), out);
        }
      }
    });
  });
  if constexpr (kToColumns) {
    unroll<kLights>([&](auto l) REBOUNCE_INLINE {
      column_out[l].store_some(vectors.column_out.data + (first + kStep * l) * out_stride + begin,
                               width);
    });
  }
}

template <typename V, bool kToRows, bool kToColumns, typename Value>
void multiply_core(const CoreMatrices<Value>& s, const CoreVectors& vectors) {
  const std::size_t rows = s.rows, columns = s.columns, count = vectors.row_in.count;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const Value* values = s.data + s.channel_matrix[c] * rows * columns;
    for (std::size_t j = 0; j < columns; j += V::kWidth) {
      std::size_t v = c;
      for (; v + kChannels < count; v += 2 * kChannels) {
        multiply_columns<V, kToRows, kToColumns, 2>(values, rows, columns, j, vectors, v);
      }
      if (v < count) {
        multiply_columns<V, kToRows, kToColumns, 1>(values, rows, columns, j, vectors, v);
      }
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
