#pragma once

// Products with the coupling matrices of low-rank blocks; the channels of a coefficient are
// neighbours. Written once over a vector type `V` (vector_load.h), like basis_kernels_impl.h.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "transfer/format/operator_format.h"
#include "transfer/format/row_format.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

using Direction = CouplingBlock::Direction;

/// Entries that stand for themselves.
struct NoStep {};

template <typename V>
REBOUNCE_INLINE inline V scaled(const V& product, NoStep /*step*/) {
  return product;
}

template <typename V>
REBOUNCE_INLINE inline V scaled(const V& product, const V& step) {
  return multiply(product, step);
}

/// The rows of a coupling matrix in floats or halves, one after the other. `Entries`: V::EntryLanes
/// or V::OneMatrixEntries.
template <typename V, typename Entries, typename Value>
class StoredRows {
 public:
  StoredRows(const Value* values, std::size_t columns, const ChannelLanes& lanes)
      : entry_(lanes),
        values_(values),
        matrices_(lanes.matrix_count),
        row_size_(columns * matrices_),
        next_(values) {}

  /// Goes to column `first` of the first row.
  REBOUNCE_INLINE void start(std::size_t first) { next_ = values_ + first * matrices_; }

  /// Loads kWide vectors of neighbouring entries of a row, and goes to the next. Returns what
  /// products with them are multiplied with (scaled).
  template <std::size_t kWide>
  REBOUNCE_INLINE NoStep load(V (&b)[kWide]) {
    if constexpr (Entries::kWholeRows) {
      entry_.load_row(next_, b);
    } else {
      const std::size_t step = V::kWidth / kChannelLanes * matrices_;
      unroll<kWide>([&](auto w) REBOUNCE_INLINE { b[w] = entry_.load(next_ + w * step); });
    }
    next_ += row_size_;
    return {};
  }

 private:
  Entries entry_;
  const Value* values_;
  std::size_t matrices_, row_size_;
  const Value* next_;
};

/// The rows of a packed coupling matrix, likewise.
template <typename V>
class PackedRows {
 public:
  PackedRows(const CouplingValues<std::uint16_t>& values, const CouplingBlock& coupling,
             const typename V::PackedLanes& lanes, std::size_t matrices)
      : lanes_(lanes),
        rows_(values.packed + coupling.values),
        formats_(values.row_format + coupling.first_row) {
    const std::uint64_t row_size = coupling.columns * matrices;
    for (unsigned width = 0; width < row_bytes_.size(); ++width) {
      row_bytes_[width] = RowFormat::bytes_of(width, row_size);
    }
  }

  REBOUNCE_INLINE void start(std::size_t first) {
    vector_ = first / (V::kWidth / kChannelLanes);
    next_ = rows_;
    next_format_ = formats_;
  }

  template <std::size_t kWide>
  REBOUNCE_INLINE V load(V (&b)[kWide]) {
    const RowFormat format{*next_format_++};
    const typename V::PackedLanes::Row row(lanes_, format);
    unroll<kWide>([&](auto w) REBOUNCE_INLINE { b[w] = row.load(next_, vector_ + w); });
    next_ += row_bytes_[format.width()];
    return row.step();
  }

 private:
  const typename V::PackedLanes& lanes_;
  const std::uint8_t *rows_, *formats_;
  std::array<std::uint64_t, 4> row_bytes_;  ///< by width
  std::size_t vector_ = 0;                  ///< the first of those that are loaded
  const std::uint8_t *next_ = nullptr, *next_format_ = nullptr;
};

/// The input coefficients of a coupling matrix.
struct EndInputs {
  const float *row, *column;
};

/// Multiplies the columns from `begin` on, as many as fill kWide vectors or are left, for one
/// light. The lanes of a vector are the channels of neighbouring entries of a row. The mean rank is
/// 5, so vectors with one entry per lane would be mostly empty. Lanes beyond the last column read
/// into the next row; their input is zero and their output is not stored.
template <typename V, Direction kDirection, std::size_t kWide, typename Rows>
REBOUNCE_INLINE inline void multiply_columns(Rows& rows, const CouplingBlock& coupling,
                                             std::size_t begin, const EndInputs& inputs,
                                             float* out) {
  constexpr bool kToRows = kDirection != Direction::kToColumns;
  constexpr bool kToColumns = kDirection != Direction::kToRows;
  constexpr std::size_t kEntries = V::kWidth / kChannelLanes, kLast = kWide - 1;
  const std::size_t last_lanes =
      (std::min(coupling.columns - begin, kWide * kEntries) - kLast * kEntries) * kChannelLanes;
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
  rows.start(begin);
  for_each_rows<kEntries>(coupling.rows, [&]<std::size_t kRows>(std::size_t i) REBOUNCE_INLINE {
    V product[kEntries];
    unroll<kEntries>([&](auto r) REBOUNCE_INLINE { product[r] = V::zero(); });
    unroll<kRows>([&](auto r) REBOUNCE_INLINE {
      V b[kWide], from_row = V::zero();
      const auto step = rows.load(b);
      if constexpr (kToColumns) {
        from_row = scaled(V::repeat_four(row_in + (i + r) * kChannelLanes), step);
      }
      unroll<kWide>([&](auto w) REBOUNCE_INLINE {
        if constexpr (kToColumns) to_columns[w] = multiply_add(b[w], from_row, to_columns[w]);
        if constexpr (kToRows) product[r] = multiply_add(b[w], from_columns[w], product[r]);
      });
      if constexpr (kToRows) product[r] = scaled(product[r], step);
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

template <typename V, Direction kDirection, typename Rows>
REBOUNCE_INLINE inline void multiply_coupling(Rows rows, const CouplingBlock& coupling,
                                              const EndInputs& inputs, float* out) {
  constexpr std::size_t kEntries = V::kWidth / kChannelLanes;
  for_each_rows<V::kCouplingVectors>((coupling.columns + kEntries - 1) / kEntries,
                                     [&]<std::size_t kWide>(std::size_t first) REBOUNCE_INLINE {
                                       multiply_columns<V, kDirection, kWide>(
                                           rows, coupling, first * kEntries, inputs, out);
                                     });
}

// Residuals rarely fill more than half a vector. Masked vectors are faster here than loops that the
// compiler vectorises.

/// One end of a coupling matrix: its coefficients, then those of residuals.
struct CouplingEnd {
  std::size_t first, count, residual_count;  ///< floats

  CouplingEnd(std::size_t coefficient, std::size_t rank, std::size_t residual_rank)
      : first(coefficient * kChannelLanes),
        count(rank * kChannelLanes),
        residual_count(residual_rank * kChannelLanes) {}
};

/// Copies the input coefficients of one end to `to`, with those of residuals added: the product may
/// overwrite them. Returns whether any is light.
template <typename V>
REBOUNCE_INLINE inline bool copy_input(const float* in, const CouplingEnd& end, float* to) {
  const V scale = V::broadcast(1 / HierarchicalFormat::kResidualScale);
  const float* const from = in + end.first;
  V any = V::zero();
  for (std::size_t k = 0; k < end.count; k += V::kWidth) {
    V coefficients = V::load_some(from + k, std::min(end.count - k, V::kWidth));
    any = any_of(any, coefficients);
    if (k < end.residual_count) {
      const V residual =
          V::load_some(from + end.count + k, std::min(end.residual_count - k, V::kWidth));
      any = any_of(any, residual);
      coefficients = multiply_add(residual, scale, coefficients);
    }
    coefficients.store(to + k);
  }
  return any.any_coefficient();
}

/// Writes the output coefficients of residuals.
template <typename V>
REBOUNCE_INLINE inline void spread_residuals(float* out, const CouplingEnd& end) {
  const V scale = V::broadcast(1 / HierarchicalFormat::kResidualScale);
  const float* const from = out + end.first;
  for (std::size_t k = 0; k < end.residual_count; k += V::kWidth) {
    const std::size_t lanes = std::min(end.residual_count - k, V::kWidth);
    multiply(V::load_some(from + k, lanes), scale)
        .store_some(out + end.first + end.count + k, lanes);
  }
}

inline void darken(float* out, const CouplingEnd& end) {
  std::fill_n(out + end.first, end.count + end.residual_count, 0.0F);
}

// Coupling matrices are prefetched this many ahead: those that a sweep or an apply skips break the
// processor's own prefetching (lab/063). Most fill at most two cache lines.
constexpr std::size_t kCouplingsAhead = 8;

inline void prefetch_two_lines(const void* p) {
  constexpr std::size_t kLine = 64;
  __builtin_prefetch(p);
  __builtin_prefetch(static_cast<const char*>(p) + kLine);
}

template <typename Value>
const void* first_value(const CouplingValues<Value>& values, const CouplingBlock& coupling) {
  if (coupling.first_row == kNotPacked) return values.values + coupling.values;
  return values.packed + coupling.values;
}

/// Multiplies in the directions that light comes from. The products of the others are zero.
template <typename V, typename Rows>
void multiply_lit(const Rows& rows, const CouplingBlock& coupling, const float* in, float* out,
                  float* scratch) {
  const CouplingEnd row(coupling.row, coupling.rows, coupling.row_residual_rank);
  const CouplingEnd column(coupling.column, coupling.columns, coupling.column_residual_rank);
  const bool to_rows = coupling.direction != Direction::kToColumns;
  const bool to_columns = coupling.direction != Direction::kToRows;
  const EndInputs inputs{scratch + end_size(coupling.columns), scratch};
  const bool light_to_rows = to_rows && copy_input<V>(in, column, scratch);
  const bool light_to_columns =
      to_columns && copy_input<V>(in, row, scratch + end_size(coupling.columns));
  // Where both ends are dark, what they have already is what the products give.
  if (!light_to_rows && !light_to_columns && to_rows && to_columns && in == out) return;
  if (light_to_rows && light_to_columns) {
    multiply_coupling<V, Direction::kBoth>(rows, coupling, inputs, out);
  } else if (light_to_rows) {
    multiply_coupling<V, Direction::kToRows>(rows, coupling, inputs, out);
  } else if (light_to_columns) {
    multiply_coupling<V, Direction::kToColumns>(rows, coupling, inputs, out);
  }
  if (light_to_rows) {
    spread_residuals<V>(out, row);
  } else if (to_rows) {
    darken(out, row);
  }
  if (light_to_columns) {
    spread_residuals<V>(out, column);
  } else if (to_columns) {
    darken(out, column);
  }
}

template <typename V, typename Entries, typename Value>
void multiply_couplings_with(const CouplingValues<Value>& values,
                             std::span<const CouplingBlock> couplings, const ChannelLanes& lanes,
                             std::size_t light_count, Coefficients<const float> in,
                             Coefficients<float> out, float* scratch) {
  const typename V::PackedLanes packed_lanes(lanes);
  for (std::size_t l = 0; l < light_count; ++l) {
    const float* const from = in.data + l * in.stride;
    float* const to = out.data + l * out.stride;
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      const CouplingBlock& coupling = couplings[k];
      if (k + kCouplingsAhead < couplings.size()) {
        prefetch_two_lines(first_value(values, couplings[k + kCouplingsAhead]));
      }
      if (coupling.first_row == kNotPacked) {
        const StoredRows<V, Entries, Value> rows(values.values + coupling.values, coupling.columns,
                                                 lanes);
        multiply_lit<V>(rows, coupling, from, to, scratch);
      } else if constexpr (std::is_same_v<Value, std::uint16_t>) {
        const PackedRows<V> rows(values, coupling, packed_lanes, lanes.matrix_count);
        multiply_lit<V>(rows, coupling, from, to, scratch);
      }
    }
  }
}

template <typename V, typename Value>
void multiply_couplings(const CouplingValues<Value>& values,
                        std::span<const CouplingBlock> couplings, const ChannelLanes& lanes,
                        std::size_t light_count, Coefficients<const float> in,
                        Coefficients<float> out, float* scratch) {
  if constexpr (V::kWidth == 16) {
    if (lanes.matrix_count == 1) {
      return multiply_couplings_with<V, typename V::OneMatrixEntries>(
          values, couplings, lanes, light_count, in, out, scratch);
    }
  }
  multiply_couplings_with<V, typename V::template EntryLanes<Value>>(values, couplings, lanes,
                                                                     light_count, in, out, scratch);
}

}  // namespace
}  // namespace rebounce
