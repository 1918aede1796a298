#include "transfer/format/hierarchical_encoding.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "rebounce/error.h"
#include "transfer/base/half_float.h"
#include "transfer/format/hierarchical_check.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/row_packing.h"
#include "transfer/format/stored_values.h"

namespace rebounce {
namespace {

using Storage = HierarchicalStorage;
using Layout = HierarchicalLayout;

using Order = HierarchicalStorage::Order;

/// Whether a block of low rank, or a cluster basis, has a basis of its own for its columns.
bool has_column_basis(const TransferBlock& block) {
  return !block.on_diagonal() && !is_cluster_basis(block);
}

/// The values of a block in the order kByBlock.
template <typename Value>
struct BlockValues {
  /// `from`: the first of them.
  BlockValues(const TransferBlock& block, const Value* from) {
    if (block.kind != TransferBlock::Kind::kDense) {
      row_basis = from;
      from += std::uint64_t{block.row_rank} * block.row_count;
      column_basis = block.on_diagonal() ? row_basis : from;
      if (has_column_basis(block)) {
        from += std::uint64_t{block.column_rank} * block.column_count;
      }
    }
    entries = from;
  }

  const Value* row_basis = nullptr;     ///< [row_rank][row_count], of low-rank blocks and bases
  const Value* column_basis = nullptr;  ///< [column_rank][column_count]; the same on the diagonal
  const Value* entries = nullptr;       ///< [matrix][rows or ranks][columns or ranks]
};

/// The number of values of one coupling matrix, or of the entries of a dense block.
std::uint64_t entry_count(const TransferBlock& block) {
  if (block.kind == TransferBlock::Kind::kDense) {
    return std::uint64_t{block.row_count} * block.column_count;
  }
  return std::uint64_t{block.row_rank} * block.column_rank;
}

/// Calls work(b, values) for the blocks that have values; `values`, in the order kByBlock, are
/// those of `storage`, and `blocks` are its blocks as in_order_streamed makes them.
template <typename Value, typename Work>
void for_each_block(const Storage& storage, std::span<const TransferBlock> blocks,
                    const Value* values, const Work& work) {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (has_values(blocks[b])) work(b, BlockValues(blocks[b], values));
    values += storage.blocks[b].value_count(storage.matrix_count);
  }
}

/// `storage` with the blocks that it has in the order kStreamed, where one with only one rank above
/// zero has rank zero. Its values stay as they are.
Storage in_order_streamed(const Storage& storage) {
  Storage streamed = storage;
  streamed.order = Order::kStreamed;
  for (TransferBlock& block : streamed.blocks) {
    if (is_cluster_basis(block)) continue;
    if (block.row_rank == 0 || block.column_rank == 0) block.row_rank = block.column_rank = 0;
  }
  return streamed;
}

/// Copies the values of block b of `layout` to their indices in the order kStreamed.
template <typename Value>
void stream_block(const Layout& layout, std::size_t b, const TransferBlock& block,
                  std::uint32_t matrix_count, const BlockValues<Value>& from, Value* to) {
  const Layout::BlockLayout& at = layout.block_layouts[b];
  const auto copy_basis = [&](const Value* basis, const Layout::End& end, std::uint64_t count) {
    std::copy_n(basis, count, to + layout.basis_index(end, 0, 0));
  };
  if (block.kind != TransferBlock::Kind::kDense) {
    copy_basis(from.row_basis, at.row, std::uint64_t{block.row_rank} * block.row_count);
    if (has_column_basis(block)) {
      copy_basis(from.column_basis, at.column,
                 std::uint64_t{block.column_rank} * block.column_count);
    }
  }
  const std::uint64_t count = entry_count(block);
  Value* const entries = to + layout.basis_value_count + at.values;
  for (std::uint32_t matrix = 0; matrix < matrix_count; ++matrix) {
    for (std::uint64_t k = 0; k < count; ++k) {
      entries[k * matrix_count + matrix] = from.entries[matrix * count + k];
    }
  }
}

/// The values of `storage` in the order of `in_order`, which in_order_streamed has made.
template <typename Value>
SharedArray<Value> stream_array(const Storage& storage, const Storage& in_order,
                                const SharedArray<Value>& values) {
  const Layout layout(in_order);
  std::vector<Value> streamed(
      Layout::padded(layout.basis_value_count + layout.coupling_value_count));
  for_each_block(storage, in_order.blocks, values.data(), [&](std::size_t b, const auto& from) {
    stream_block(layout, b, in_order.blocks[b], storage.matrix_count, from, streamed.data());
  });
  return SharedArray(std::move(streamed));
}

/// How often the entries have to be divided by four to come into the range of halves. 0 if the
/// operator has no scales of positions, which can be multiplied to match.
int powers_beyond_halves(const Storage& exact, std::span<const TransferBlock> blocks) {
  if (exact.scale_exponent.empty()) return 0;
  // Half of the range of a half: rounding the bases makes entries of coupling matrices a little
  // larger.
  constexpr float kMost = 65504 / HierarchicalFormat::kHalfScale / 2;
  float largest = 0;
  for_each_block(exact, blocks, exact.values_f32.data(), [&](std::size_t b, const auto& values) {
    const std::uint64_t count = entry_count(blocks[b]) * exact.matrix_count;
    for (const float entry : std::span(values.entries, count)) {
      largest = std::max(largest, std::abs(entry));
    }
  });
  if (!(largest > kMost) || !std::isfinite(largest)) return 0;
  return static_cast<int>(std::ceil(std::log2(largest / kMost) / 2));
}

/// Changes the scales of positions, and the steps that entries are rounded to, for entries that are
/// divided by four `power` times.
void fit_scales(int power, Storage& rounded) {
  for (TransferBlock& block : rounded.blocks) {
    block.coupling_step = std::ldexp(block.coupling_step, -2 * power);
  }
  for (std::int8_t& exponent : rounded.scale_exponent) {
    exponent = static_cast<std::int8_t>(exponent + power);
  }
}

// The largest magnitude of the integers that bases are rounded to.
constexpr float kLargestByte = 127;

/// Writes an operator in f32 in another precision. Where bases become integers, the scales of their
/// vectors are multiplied into the coupling matrices, and these are packed.
template <typename Basis, typename Coupling>
class Encoder {
 public:
  /// `exact` is in the order kByBlock; its entries are divided by four `power` times. `bases` and
  /// `couplings` have room for all values and hold zeros; `rows` for packed coupling matrices.
  Encoder(const Storage& exact, int power, const Storage& rounded, Basis* bases,
          Coupling* couplings, RowPacking& rows)
      : matrix_count_(exact.matrix_count),
        factor_(std::ldexp(1.0F, -2 * power)),
        to_(rounded),
        position_count_(HierarchicalFormat::position_count(exact.area.size())),
        exact_coefficient_scale_(exact.coefficient_scale),
        coefficient_scale_(exact.coefficient_scale),
        bases_(bases),
        couplings_(couplings),
        rows_(rows) {
    for_each_block(exact, rounded.blocks, exact.values_f32.data(),
                   [&](std::size_t b, const BlockValues<float>& from) {
                     encode(rounded.blocks[b], from, to_.block_layouts[b]);
                   });
  }

  std::vector<float> release_coefficient_scale() { return std::move(coefficient_scale_); }

 private:
  static constexpr bool kIntegers = std::is_same_v<Basis, std::int8_t>;

  void encode(const TransferBlock& block, const BlockValues<float>& from,
              const Layout::BlockLayout& to) {
    Coupling* encoded = couplings_ + to.values;
    if (block.kind == TransferBlock::Kind::kDense) {
      for (std::uint32_t r = 0; r < block.row_count; ++r) {
        for (const float entry : entries_of(from, r, block.row_count, block.column_count)) {
          store_coupling(entry, *encoded++);
        }
      }
      return;
    }
    const EndScales rows =
        encode_basis(from.row_basis, to.row, block.row_rank, {block.row_begin, block.row_count});
    if (is_cluster_basis(block)) {
      for (const float row : rows.scale) coefficient_scale_[next_coefficient_++] *= row;
      return;
    }
    const EndScales columns = encode_basis(from.column_basis, to.column, block.column_rank,
                                           {block.column_begin, block.column_count});
    for (std::uint32_t r = 0; r < block.row_rank; ++r) {
      const std::span<const float> row = entries_of(from, r, block.row_rank, block.column_rank);
      if constexpr (kIntegers) {
        pack(row, rows.scale[r], columns.scale,
             block.coupling_step * rows.relative[r] * common_factor(columns.relative));
      } else {
        for (const float entry : row) store_coupling(entry, *encoded++);
      }
    }
  }

  /// A row of the entries of all matrices, [column][matrix]. Valid until the next call.
  std::span<const float> entries_of(const BlockValues<float>& from, std::uint32_t row,
                                    std::uint32_t rows, std::uint32_t columns) {
    row_.resize(std::size_t{columns} * matrix_count_);
    for (std::size_t m = 0; m < matrix_count_; ++m) {
      const float* const entries = from.entries + (m * rows + row) * columns;
      for (std::size_t c = 0; c < columns; ++c) {
        row_[c * matrix_count_ + m] = factor_ * entries[c];
      }
    }
    return row_;
  }

  /// Packs a row of a coupling matrix times the scales of its vectors.
  void pack(std::span<const float> coupling, float row, std::span<const float> columns,
            double step) {
    std::vector<float> scaled;
    for (std::size_t k = 0; k < coupling.size(); ++k) {
      scaled.push_back(coupling[k] * row * columns[k / matrix_count_] * kCouplingScale<Coupling>);
    }
    rows_.append(scaled, step * kCouplingScale<Coupling>);
  }

  /// The scales of the vectors of one end.
  struct EndScales {
    std::vector<float> scale;      ///< step times the integer that stands for 1
    std::vector<double> relative;  ///< to the norms of the vectors over positions
  };

  /// One factor for all columns, with which the sum of their squared errors is that of own ones.
  static double common_factor(std::span<const double> relative) {
    double sum = 0;
    for (const double factor : relative) {
      if (factor > 0) sum += 1 / (factor * factor);
    }
    return sum > 0 ? std::sqrt(static_cast<double>(relative.size()) / sum) : 0;
  }

  /// A range of positions or of cluster coefficients.
  struct Range {
    std::uint32_t begin, count;
  };

  EndScales encode_basis(const float* basis, const Layout::End& to, std::size_t rank,
                         const Range& range) {
    EndScales scales{std::vector<float>(rank, 1.0F), std::vector<double>(rank, 1.0)};
    std::vector<float> vector(range.count);
    for (std::size_t r = 0; r < rank; ++r) {
      std::copy_n(basis + r * range.count, range.count, vector.begin());
      if constexpr (kIntegers) {
        const double norm = norm_over_positions(vector, range.begin);
        scales.scale[r] = put_integers(vector, to, rank, r);
        scales.relative[r] = norm > 0 ? scales.scale[r] / norm : 0;
      } else {
        for (std::size_t k = 0; k < range.count; ++k) {
          put(vector[k], bases_[to_.basis_index(to, r, k)]);
        }
      }
    }
    return scales;
  }

  /// The norm of a vector, which begins at a position or at a cluster coefficient. The vectors of
  /// cluster bases have norm 1.
  double norm_over_positions(std::span<const float> vector, std::uint32_t begin) const {
    double sum = 0;
    for (std::size_t k = 0; k < vector.size(); ++k) {
      const double scale =
          begin < position_count_ ? 1 : exact_coefficient_scale_[begin - position_count_ + k];
      sum += std::pow(scale * vector[k], 2);
    }
    return std::sqrt(sum);
  }

  static void put(float value, float& stored) { stored = value; }
  static void put(float value, std::uint16_t& stored) { stored = float_to_half(value); }

  float put_integers(std::vector<float>& rest, const Layout::End& to, std::size_t rank,
                     std::size_t r) {
    float largest = 0;
    for (const float v : rest) largest = std::max(largest, std::abs(v));
    const float step = largest / kLargestByte;
    put_multiples(rest, step, to, r);
    if (r < to.residual_rank) {
      put_multiples(rest, step / HierarchicalFormat::kResidualScale, to, rank + r);
    }
    return step * kBasisScale<Basis>;
  }

  /// Stores a vector as integer multiples of `step` and replaces it by the rounding error.
  void put_multiples(std::span<float> vector, float step, const Layout::End& to, std::size_t rank) {
    if (step == 0) return;
    for (std::size_t k = 0; k < vector.size(); ++k) {
      const float steps = std::clamp(std::round(vector[k] / step), -kLargestByte, kLargestByte);
      bases_[to_.basis_index(to, rank, k)] = static_cast<Basis>(steps);
      vector[k] -= steps * step;
    }
  }

  std::uint32_t matrix_count_;
  float factor_;
  Layout to_;
  std::size_t position_count_;
  std::span<const float> exact_coefficient_scale_;
  std::vector<float> coefficient_scale_;
  std::size_t next_coefficient_ = 0;  ///< index of the next cluster coefficient
  Basis* bases_;
  Coupling* couplings_;
  RowPacking& rows_;
  std::vector<float> row_;  ///< that entries_of has found last
};

/// A format, not yet known, for each row of the coupling matrices.
std::vector<std::uint8_t> rows_to_pack(const Storage& storage) {
  std::size_t count = 0;
  for (const TransferBlock& block : storage.blocks) {
    if (block.kind == TransferBlock::Kind::kLowRank) count += block.row_rank;
  }
  return std::vector<std::uint8_t>(count);
}

/// Rounds `exact`, in f32 and in the order kByBlock, to `precision`.
Storage rounded_to(const HierarchicalPrecision& precision, const Storage& exact) {
  Storage rounded = in_order_streamed(exact);
  rounded.precision = precision;
  rounded.values_f32 = {};
  const int power = powers_beyond_halves(exact, rounded.blocks);
  fit_scales(power, rounded);
  if (precision.bases != BasisPrecision::kQ8) {
    for (TransferBlock& block : rounded.blocks)
      block.row_residual_rank = block.column_residual_rank = 0;
  }
  if (rounded.has_packed_couplings()) rounded.row_format = rows_to_pack(rounded);
  RowPacking rows;
  const Layout layout(rounded);
  with_bases(rounded, [&]<typename Basis>(SharedArray<Basis>& bases) {
    with_couplings(rounded, [&]<typename Coupling>(SharedArray<Coupling>& couplings) {
      const std::uint64_t basis_count = layout.basis_value_count;
      std::vector<Basis> basis_values(
          Layout::padded(basis_count + (rounded.one_array() ? layout.coupling_value_count : 0)));
      const auto encode_into = [&](Coupling* coupling_values) {
        Encoder<Basis, Coupling> encoder(exact, power, rounded, basis_values.data(),
                                         coupling_values, rows);
        rounded.coefficient_scale = encoder.release_coefficient_scale();
      };
      if constexpr (std::is_same_v<Basis, Coupling>) {
        encode_into(basis_values.data() + basis_count);
      } else {
        std::vector<Coupling> coupling_values(Layout::padded(layout.coupling_value_count));
        encode_into(coupling_values.data());
        couplings = SharedArray(std::move(coupling_values));
      }
      bases = SharedArray(std::move(basis_values));
    });
  });
  if (rounded.has_packed_couplings()) {
    rounded.row_format = rows.formats();
    rounded.packed_couplings = SharedArray(rows.release_bytes());
  }
  return rounded;
}

}  // namespace

Storage stream_values(Storage storage) {
  check_hierarchical_storage(storage);
  if (storage.order == Order::kStreamed) return storage;
  Storage streamed = in_order_streamed(storage);
  with_bases(streamed, [&](auto& array) { array = stream_array(storage, streamed, array); });
  return streamed;
}

Storage encode_values(const Storage& storage, Precision precision) {
  if (storage.precision != hierarchical_precision(Precision::kF32)) {
    throw Error("hierarchical operator: values in " + precision_name(storage.precision) +
                " cannot be rounded again; give them in f32");
  }
  if (precision == Precision::kF32) return stream_values(storage);
  check_hierarchical_storage(storage);
  if (storage.order != Order::kByBlock) {
    throw Error("hierarchical operator: only values in the order of blocks can be rounded");
  }
  return rounded_to(hierarchical_precision(precision), storage);
}

}  // namespace rebounce
