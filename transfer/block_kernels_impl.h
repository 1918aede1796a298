#pragma once

// The block kernels, written once over a vector type `V` (vector_load.h). Included by one file per
// instruction set; everything is in an unnamed namespace so that no two sets share an
// instantiation.
//
// Twelve sums are kept in registers wherever possible: enough to hide the latency of the
// multiply-adds, and as many as AVX2 has room for. A value that was loaded and widened serves the
// three channels of a light, and of two lights where the registers suffice.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "block_kernels.h"
#include "integer_kernels_impl.h"
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

/// Stores the sums over the lanes of kRows vectors of three channels, those of a row side by side.
template <std::size_t kRows, typename V>
REBOUNCE_INLINE inline void store_sums_side_by_side(const V (&red)[kRows], const V (&green)[kRows],
                                                    const V (&blue)[kRows], float* p) {
  if constexpr (kRows == 4 && V::kWidth == 4 * kChannelLanes) {
    V::sums_side_by_side(red, green, blue).store(p);
  } else {
    store_side_by_side<kRows>(sums_of(red), sums_of(green), sums_of(blue), p);
  }
}

/// Where the coefficient of vector v, a channel of a light, is among those of a rank.
constexpr std::size_t lane_of(std::size_t v, std::size_t light_stride) {
  return v / kChannels * light_stride + v % kChannels;
}

/// Values that are read in order, as those of bases and dense blocks are.
template <typename V, typename Value>
REBOUNCE_INLINE inline V load_ahead(const Value* values) {
  constexpr std::size_t kLine = 64;
  if constexpr (V::kWidth * sizeof(float) == kLine) {
    __builtin_prefetch(values + kAhead / sizeof(Value));
  }
  return load_values<V>(values);
}

/// Products of kRows rows of `size` values with kVectors vectors, not yet added up over the lanes.
template <typename V, std::size_t kRows, std::size_t kVectors, typename Value>
REBOUNCE_INLINE inline void multiply_rows(const Value* rows, std::size_t size, const float* x,
                                          std::size_t x_stride, V (&sum)[kVectors][kRows]) {
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[v][r] = V::zero(); });
  });
  for (std::size_t k = 0; k < size; k += V::kWidth) {
    V b[kRows];
    unroll<kRows>([&](auto r) REBOUNCE_INLINE { b[r] = load_ahead<V>(rows + r * size + k); });
    unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
      const V xv = V::load(x + v * x_stride + k);
      unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[v][r] = multiply_add(b[r], xv, sum[v][r]); });
    });
  }
}

template <typename V, std::size_t kRows, std::size_t kVectors, typename Value>
REBOUNCE_INLINE inline void project_rows(const Value* basis, std::size_t size, const float* x,
                                         std::size_t x_stride, float* coefficient,
                                         std::size_t light_stride) {
  V sum[kVectors][kRows];
  multiply_rows<V, kRows, kVectors>(basis, size, x, x_stride, sum);
  unroll<kVectors / kChannels>([&](auto l) REBOUNCE_INLINE {
    constexpr std::size_t kFirst = l * kChannels;
    store_sums_side_by_side<kRows>(sum[kFirst], sum[kFirst + 1], sum[kFirst + 2],
                                   coefficient + l * light_stride);
  });
}

template <typename V, typename Value>
void project(const Value* values, std::span<const BasisPart> parts, PlanarVectors<const float> x,
             Coefficients<float> coefficient) {
  for (const BasisPart& part : parts) {
    const Value* const basis = values + part.values + std::size_t{part.first_rank} * part.size;
    const float* const from = x.data + part.position;
    float* const to =
        coefficient.data + std::size_t{part.coefficient + part.first_rank} * kChannelLanes;
    for_each_rows<4>(
        part.last_rank - part.first_rank, [&]<std::size_t kRows>(std::size_t r) REBOUNCE_INLINE {
          for_each_group<V>(x.count, [&]<std::size_t kVectors>(std::size_t v) REBOUNCE_INLINE {
            project_rows<V, kRows, kVectors>(
                basis + r * part.size, part.size, from + v * x.stride, x.stride,
                to + lane_of(v, coefficient.stride) + r * kChannelLanes, coefficient.stride);
          });
        });
  }
}

/// Whether what comes out is added to what was there, a multiple of it is, or it takes its place.
enum class Output : std::uint8_t { kAdd, kAddScaled, kSet };

/// y of kSize positions, where at(v, r) points to the coefficient of vector v and rank r; ranks are
/// dealt out among kSplit sums, so that there are twelve of them or more.
template <typename V, std::size_t kSize, std::size_t kVectors, Output kOutput, typename Value,
          typename At>
REBOUNCE_INLINE inline void expand_strip(const Value* basis, std::size_t rank, std::size_t size,
                                         const At& at, float* y, std::size_t y_stride,
                                         float scale) {
  constexpr std::size_t kWide = kSize / V::kWidth;
  constexpr std::size_t kSums = kVectors * kWide;
  constexpr std::size_t kSplit = kSums < 12 ? 12 / kSums : 1;
  V sum[kSplit][kVectors][kWide];
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kWide>([&](auto k) REBOUNCE_INLINE {
      sum[0][v][k] =
          kOutput == Output::kAdd ? V::load(y + v * y_stride + k * V::kWidth) : V::zero();
      unroll<kSplit - 1>([&](auto s) REBOUNCE_INLINE { sum[s + 1][v][k] = V::zero(); });
    });
  });
  const auto add_rank = [&](std::size_t r, auto s) REBOUNCE_INLINE {
    V b[kWide];
    unroll<kWide>([&](auto k)
                      REBOUNCE_INLINE { b[k] = load_ahead<V>(basis + r * size + k * V::kWidth); });
    unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
      const V c = V::broadcast(*at(v, r));
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
      float* const to = y + v * y_stride + k * V::kWidth;
      if constexpr (kOutput == Output::kAddScaled) {
        total = multiply_add(V::broadcast(scale), total, V::load(to));
      }
      total.store(to);
    });
  });
}

/// y of all strips of `size` values within [k, end).
template <typename V, std::size_t kVectors, Output kOutput, typename Value, typename At>
REBOUNCE_INLINE inline void expand_strips(const Value* basis, std::size_t rank, std::size_t size,
                                          const At& at, std::size_t k, std::size_t end, float* y,
                                          std::size_t y_stride, float scale = 1) {
  const auto add_strips = [&]<std::size_t kSize>() REBOUNCE_INLINE {
    for (; k + kSize <= end; k += kSize) {
      expand_strip<V, kSize, kVectors, kOutput>(basis + k, rank, size, at, y + k, y_stride, scale);
    }
  };
  if constexpr (V::kStrip >= 64) add_strips.template operator()<64>();
  if constexpr (V::kStrip >= 32) add_strips.template operator()<32>();
  add_strips.template operator()<16>();
}

template <typename V, typename Value>
void expand(const Value* values, std::span<const BasisPart> parts,
            Coefficients<const float> coefficient, PlanarVectors<float> y) {
  for (const BasisPart& part : parts) {
    const Value* const basis = values + part.values + std::size_t{part.first_rank} * part.size;
    const float* const from =
        coefficient.data + std::size_t{part.coefficient + part.first_rank} * kChannelLanes;
    for_each_group<V>(y.count, [&]<std::size_t kVectors>(std::size_t v) REBOUNCE_INLINE {
      const float* const c = from + lane_of(v, coefficient.stride);
      const auto at = [&](std::size_t w, std::size_t r) REBOUNCE_INLINE {
        return c + lane_of(w, coefficient.stride) + r * kChannelLanes;
      };
      expand_strips<V, kVectors, Output::kAdd>(basis, part.last_rank - part.first_rank, part.size,
                                               at, part.first_place, part.last_place,
                                               y.data + v * y.stride + part.position, y.stride);
    });
  }
}

using Direction = CoreBlock::Direction;

/// Neighbouring entries of a row of a core, whose next ones are `step` values on.
template <typename V, std::size_t kWide, typename Entries, typename Value>
REBOUNCE_INLINE inline void load_row(const Entries& entry, const Value* row, std::size_t step,
                                     V (&b)[kWide]) {
  if constexpr (Entries::kWholeRows) {
    entry.load_row(row, b);
  } else {
    unroll<kWide>([&](auto w) REBOUNCE_INLINE { b[w] = entry.load(row + w * step); });
  }
}

/// Columns from `begin` on, as many as fill kWide vectors or are left, for one light. The lanes of
/// a vector are the channels of neighbouring entries of a row: ranks are 5 in the mean, and vectors
/// of as many entries as there are lanes would be two thirds empty. Lanes beyond the last column
/// read on into the next row: what comes in there is zero, and what comes out is not stored.
template <typename V, Direction kDirection, std::size_t kWide, typename Entries, typename Value>
REBOUNCE_INLINE inline void multiply_columns(const Value* values, const CoreBlock& core,
                                             std::size_t begin, const ChannelLanes& lanes,
                                             const float* in, float* out) {
  constexpr bool kToRows = kDirection != Direction::kToColumns;
  constexpr bool kToColumns = kDirection != Direction::kToRows;
  constexpr std::size_t kEntries = V::kWidth / kChannelLanes, kLast = kWide - 1;
  const Entries entry(lanes);
  const std::size_t step = core.columns * lanes.matrix_count;
  const std::size_t last_lanes =
      (std::min(core.columns - begin, kWide * kEntries) - kLast * kEntries) * kChannelLanes;
  const Value* const s = values + begin * lanes.matrix_count;
  const float* const row_in = in + core.row * kChannelLanes;
  const float* const column_in = in + (core.column + begin) * kChannelLanes;
  float* const row_out = out + core.row * kChannelLanes;
  float* const column_out = out + (core.column + begin) * kChannelLanes;
  V from_columns[kWide], to_columns[kWide];
  unroll<kWide>([&](auto w) REBOUNCE_INLINE {
    to_columns[w] = V::zero();
    if constexpr (kToRows && w < kLast) from_columns[w] = V::load(column_in + w * V::kWidth);
  });
  if constexpr (kToRows) {
    from_columns[kLast] = V::load_some(column_in + kLast * V::kWidth, last_lanes);
  }
  for_each_rows<kEntries>(core.rows, [&]<std::size_t kRows>(std::size_t i) REBOUNCE_INLINE {
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
REBOUNCE_INLINE inline void multiply_core(const Value* values, const CoreBlock& core,
                                          const ChannelLanes& lanes, const float* in, float* out) {
  constexpr std::size_t kEntries = V::kWidth / kChannelLanes;
  for_each_rows<V::kCoreVectors>((core.columns + kEntries - 1) / kEntries,
                                 [&]<std::size_t kWide>(std::size_t first) REBOUNCE_INLINE {
                                   multiply_columns<V, kDirection, kWide, Entries>(
                                       values, core, first * kEntries, lanes, in, out);
                                 });
}

// Cores are asked for this many before their turn: sweeps and applies leave out what lies between
// them. Most have two cache lines at most.
constexpr std::size_t kCoresAhead = 8;

inline void ask_for_two_lines(const void* p) {
  constexpr std::size_t kLine = 64;
  __builtin_prefetch(p);
  __builtin_prefetch(static_cast<const char*>(p) + kLine);
}

template <typename V, typename Entries, typename Value>
void multiply_cores_with(const Value* values, std::span<const CoreBlock> cores,
                         const ChannelLanes& lanes, std::size_t light_count,
                         Coefficients<const float> in, Coefficients<float> out) {
  for (std::size_t l = 0; l < light_count; ++l) {
    const float* const from = in.data + l * in.stride;
    float* const to = out.data + l * out.stride;
    for (std::size_t k = 0; k < cores.size(); ++k) {
      const CoreBlock& core = cores[k];
      const Value* const s = values + core.values;
      if (k + kCoresAhead < cores.size()) {
        ask_for_two_lines(values + cores[k + kCoresAhead].values);
      }
      switch (core.direction) {
        case Direction::kBoth:
          multiply_core<V, Direction::kBoth, Entries>(s, core, lanes, from, to);
          break;
        case Direction::kToRows:
          multiply_core<V, Direction::kToRows, Entries>(s, core, lanes, from, to);
          break;
        case Direction::kToColumns:
          multiply_core<V, Direction::kToColumns, Entries>(s, core, lanes, from, to);
          break;
      }
    }
  }
}

template <typename V, typename Value>
void multiply_cores(const Value* values, std::span<const CoreBlock> cores,
                    const ChannelLanes& lanes, std::size_t light_count,
                    Coefficients<const float> in, Coefficients<float> out) {
  if constexpr (V::kWidth == 16) {
    if (lanes.matrix_count == 1) {
      using Entries = typename V::OneMatrixEntries;
      return multiply_cores_with<V, Entries>(values, cores, lanes, light_count, in, out);
    }
  }
  using Entries = typename V::template EntryLanes<Value>;
  multiply_cores_with<V, Entries>(values, cores, lanes, light_count, in, out);
}

/// Where the products of a dense block with a light are put.
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

/// Sums over the columns of as many rows as V is wide; multiply(r, sum) makes the vectors of four
/// rows from r on, not yet added up over the lanes.
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

/// Both ways at once, where the sums over rows stay in registers.
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

/// One light: sums over columns as light is projected, sums over rows as it is expanded. A block is
/// in the nearest cache when it is read for the second.
template <typename V, Output kOutput, typename Value>
REBOUNCE_INLINE inline void multiply_dense_block(const Value* values, const DenseBlock& block,
                                                 PlanarVectors<const float> x,
                                                 const DenseOutput& out) {
  if constexpr (V::kWidth == 16) {
    if (block.direction == Direction::kBoth && block.columns == 16) {
      return multiply_narrow_block<V, 1, kOutput>(values, block, x, out);
    }
    if (block.direction == Direction::kBoth && block.columns == 32) {
      return multiply_narrow_block<V, 2, kOutput>(values, block, x, out);
    }
  }
  if (block.direction != Direction::kToColumns) {
    const auto multiply = [&](std::size_t r, V(&sum)[kChannels][4]) REBOUNCE_INLINE {
      multiply_rows<V, 4, kChannels>(values + r * block.columns, block.columns,
                                     x.data + block.column_position, x.stride, sum);
    };
    put_row_sums<V, kOutput>(multiply, block.rows, out);
  }
  if (block.direction != Direction::kToRows) {
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

template <typename V, typename Value>
constexpr BasisKernels<Value> make_basis_kernels() {
  return {project<V, Value>, expand<V, Value>};
}

template <typename V, typename N>
constexpr BlockKernelSet make_block_kernels(const char* instruction_set) {
  return {
      instruction_set,
      make_basis_kernels<V, float>(),
      make_basis_kernels<V, std::uint16_t>(),
      {project_integers<N>, expand_integers<N>},
      make_basis_kernels<V, std::int8_t>(),
      {multiply_cores<V, float>, multiply_dense<V, float>, add_products<V>, add_dense<V, float>},
      {multiply_cores<V, std::uint16_t>, multiply_dense<V, std::uint16_t>, add_products<V>,
       add_dense<V, std::uint16_t>}};
}

}  // namespace
}  // namespace rebounce
