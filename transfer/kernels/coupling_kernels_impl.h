#pragma once

// Products with the coupling matrices of low-rank blocks; the channels of a coefficient are
// neighbours. Written once over a vector type `V` (vector_load.h), like basis_kernels_impl.h.

#include <algorithm>
#include <cstddef>
#include <span>

#include "transfer/format/operator_format.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

using Direction = CouplingBlock::Direction;

/// Loads kWide vectors of neighbouring entries of a row of a coupling matrix, `step` values apart.
template <typename V, std::size_t kWide, typename Entries, typename Value>
REBOUNCE_INLINE inline void load_row(const Entries& entry, const Value* row, std::size_t step,
                                     V (&b)[kWide]) {
  if constexpr (Entries::kWholeRows) {
    entry.load_row(row, b);
  } else {
    unroll<kWide>([&](auto w) REBOUNCE_INLINE { b[w] = entry.load(row + w * step); });
  }
}

/// The input coefficients of a coupling matrix.
struct EndInputs {
  const float *row, *column;
};

/// Multiplies the columns from `begin` on, as many as fill kWide vectors or are left, for one
/// light. The lanes of a vector are the channels of neighbouring entries of a row. The mean rank is
/// 5, so vectors with one entry per lane would be mostly empty. Lanes beyond the last column read
/// into the next row; their input is zero and their output is not stored.
template <typename V, Direction kDirection, std::size_t kWide, typename Entries, typename Value>
REBOUNCE_INLINE inline void multiply_columns(const Value* values, const CouplingBlock& coupling,
                                             std::size_t begin, const ChannelLanes& lanes,
                                             const EndInputs& inputs, float* out) {
  constexpr bool kToRows = kDirection != Direction::kToColumns;
  constexpr bool kToColumns = kDirection != Direction::kToRows;
  constexpr std::size_t kEntries = V::kWidth / kChannelLanes, kLast = kWide - 1;
  const Entries entry(lanes);
  const std::size_t step = coupling.columns * lanes.matrix_count;
  const std::size_t last_lanes =
      (std::min(coupling.columns - begin, kWide * kEntries) - kLast * kEntries) * kChannelLanes;
  const Value* const s = values + begin * lanes.matrix_count;
  const float* const row_in = inputs.row;
  const float* const column_in = inputs.column + begin * kChannelLanes;
  float* const row_out = out + coupling.row * kChannelLanes;
  float* const column_out = out + (coupling.column + begin) * kChannelLanes;
  V from_columns[kWide], to_columns[kWide];
  unroll<kWide>([&](auto w) REBOUNCE_INLINE {
    to_columns[w] = V::zero();
    if constexpr (kToRows && w < kLast) from_columns[w] = V::load(column_in + w * V::kWidth);
  });
  if constexpr (kToRows) {
    from_columns[kLast] = V::load_some(column_in + kLast * V::kWidth, last_lanes);
  }
  for_each_rows<kEntries>(coupling.rows, [&]<std::size_t kRows>(std::size_t i) REBOUNCE_INLINE {
    V product[kEntries];
    unroll<kEntries>([&](auto r) REBOUNCE_INLINE { product[r] = V::zero(); });
    unroll<kRows>([&](auto r) REBOUNCE_INLINE {
      V b[kWide];
      load_row(entry, s + (i + r) * step, kEntries * lanes.matrix_count, b);
      unroll<kWide>([&](auto w) REBOUNCE_INLINE {
        if constexpr (kToColumns) {
          to_columns[w] =
              multiply_add(b[w], V::repeat_four(row_in + (i + r) * kChannelLanes), to_columns[w]);
        }
        if constexpr (kToRows) product[r] = multiply_add(b[w], from_columns[w], product[r]);
      });
    });
    if constexpr (kToRows) {
      V sum = V::sums_of_fours(product);
      if (begin > 0)
        sum = add(sum, V::load_some(row_out + i * kChannelLanes, kRows * kChannelLanes));
      sum.store_some(row_out + i * kChannelLanes, kRows * kChannelLanes);
    }
  });
  if constexpr (kToColumns) {
    unroll<kLast>([&](auto w) REBOUNCE_INLINE { to_columns[w].store(column_out + w * V::kWidth); });
    to_columns[kLast].store_some(column_out + kLast * V::kWidth, last_lanes);
  }
}

template <typename V, Direction kDirection, typename Entries, typename Value>
REBOUNCE_INLINE inline void multiply_coupling(const Value* values, const CouplingBlock& coupling,
                                              const ChannelLanes& lanes, const EndInputs& inputs,
                                              float* out) {
  constexpr std::size_t kEntries = V::kWidth / kChannelLanes;
  for_each_rows<V::kCouplingVectors>((coupling.columns + kEntries - 1) / kEntries,
                                     [&]<std::size_t kWide>(std::size_t first) REBOUNCE_INLINE {
                                       multiply_columns<V, kDirection, kWide, Entries>(
                                           values, coupling, first * kEntries, lanes, inputs, out);
                                     });
}

// Residuals rarely fill more than half a vector. Masked vectors are faster here than loops that the
// compiler vectorises.

/// Returns the input coefficients of one end, with those of residuals added. It copies them to
/// `scratch` if residuals change them or the product overwrites them; otherwise it returns `in`.
template <typename V>
REBOUNCE_INLINE inline const float* end_input(const float* in, std::size_t rank,
                                              std::size_t residual_rank, bool in_place,
                                              float* scratch) {
  if (!in_place && residual_rank == 0) return in;
  const V scale = V::broadcast(1 / HierarchicalFormat::kResidualScale);
  const std::size_t count = rank * kChannelLanes, rest = residual_rank * kChannelLanes;
  for (std::size_t k = 0; k < count; k += V::kWidth) {
    V coefficients = V::load_some(in + k, std::min(count - k, V::kWidth));
    if (k < rest) {
      const V residual = V::load_some(in + count + k, std::min(rest - k, V::kWidth));
      coefficients = multiply_add(residual, scale, coefficients);
    }
    coefficients.store(scratch + k);
  }
  return scratch;
}

/// Writes the output coefficients of residuals.
template <typename V>
REBOUNCE_INLINE inline void spread_residuals(float* out, std::size_t rank,
                                             std::size_t residual_rank) {
  const V scale = V::broadcast(1 / HierarchicalFormat::kResidualScale);
  float* const residual = out + rank * kChannelLanes;
  const std::size_t count = residual_rank * kChannelLanes;
  for (std::size_t k = 0; k < count; k += V::kWidth) {
    const std::size_t lanes = std::min(count - k, V::kWidth);
    multiply(V::load_some(out + k, lanes), scale).store_some(residual + k, lanes);
  }
}

/// Multiplies a coupling matrix in one or both directions, with the residuals of its ends.
template <typename V, Direction kDirection, typename Entries, typename Value>
REBOUNCE_INLINE inline void multiply_ends(const Value* values, const CouplingBlock& coupling,
                                          const ChannelLanes& lanes, const float* in, float* out,
                                          float* scratch) {
  const std::size_t row = std::size_t{coupling.row} * kChannelLanes;
  const std::size_t column = std::size_t{coupling.column} * kChannelLanes;
  const bool in_place = in == out;
  EndInputs ends{};
  if constexpr (kDirection != Direction::kToColumns) {
    ends.column = end_input<V>(in + column, coupling.columns, coupling.column_residual_rank,
                               in_place, scratch);
  }
  if constexpr (kDirection != Direction::kToRows) {
    ends.row = end_input<V>(in + row, coupling.rows, coupling.row_residual_rank, in_place,
                            scratch + end_size(coupling.columns));
  }
  multiply_coupling<V, kDirection, Entries>(values, coupling, lanes, ends, out);
  if constexpr (kDirection != Direction::kToColumns) {
    spread_residuals<V>(out + row, coupling.rows, coupling.row_residual_rank);
  }
  if constexpr (kDirection != Direction::kToRows) {
    spread_residuals<V>(out + column, coupling.columns, coupling.column_residual_rank);
  }
}

// Coupling matrices are prefetched this many ahead: those that a sweep or an apply skips break the
// processor's own prefetching (lab/063). Most fill at most two cache lines.
constexpr std::size_t kCouplingsAhead = 8;

inline void prefetch_two_lines(const void* p) {
  constexpr std::size_t kLine = 64;
  __builtin_prefetch(p);
  __builtin_prefetch(static_cast<const char*>(p) + kLine);
}

template <typename V, typename Entries, typename Value>
void multiply_couplings_with(const Value* values, std::span<const CouplingBlock> couplings,
                             const ChannelLanes& lanes, std::size_t light_count,
                             Coefficients<const float> in, Coefficients<float> out,
                             float* scratch) {
  for (std::size_t l = 0; l < light_count; ++l) {
    const float* const from = in.data + l * in.stride;
    float* const to = out.data + l * out.stride;
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      const CouplingBlock& coupling = couplings[k];
      const Value* const s = values + coupling.values;
      if (k + kCouplingsAhead < couplings.size()) {
        prefetch_two_lines(values + couplings[k + kCouplingsAhead].values);
      }
      switch (coupling.direction) {
        case Direction::kBoth:
          multiply_ends<V, Direction::kBoth, Entries>(s, coupling, lanes, from, to, scratch);
          break;
        case Direction::kToRows:
          multiply_ends<V, Direction::kToRows, Entries>(s, coupling, lanes, from, to, scratch);
          break;
        case Direction::kToColumns:
          multiply_ends<V, Direction::kToColumns, Entries>(s, coupling, lanes, from, to, scratch);
          break;
      }
    }
  }
}

template <typename V, typename Value>
void multiply_couplings(const Value* values, std::span<const CouplingBlock> couplings,
                        const ChannelLanes& lanes, std::size_t light_count,
                        Coefficients<const float> in, Coefficients<float> out, float* scratch) {
  if constexpr (V::kWidth == 16) {
    if (lanes.matrix_count == 1) {
      using Entries = typename V::OneMatrixEntries;
      return multiply_couplings_with<V, Entries>(values, couplings, lanes, light_count, in, out,
                                                 scratch);
    }
  }
  using Entries = typename V::template EntryLanes<Value>;
  multiply_couplings_with<V, Entries>(values, couplings, lanes, light_count, in, out, scratch);
}

}  // namespace
}  // namespace rebounce
