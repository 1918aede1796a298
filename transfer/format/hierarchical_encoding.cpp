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

/// Copies the values of one block from the order kByBlock to their indices in the order kStreamed.
template <typename Value>
void copy_block(const HierarchicalLayout& layout, const TransferBlock& block,
                const HierarchicalLayout::BlockLayout& block_layout, std::uint32_t matrix_count,
                const Value* from, Value* to) {
  const bool dense = block.kind == TransferBlock::Kind::kDense;
  const auto copy_basis = [&](const HierarchicalLayout::End& end, std::uint64_t count) {
    std::copy_n(from, count, to + layout.basis_index(end, 0, 0));
    from += count;
  };
  if (!dense) {
    copy_basis(block_layout.row, std::uint64_t{block.row_rank} * block.row_count);
    if (!block.on_diagonal() && !is_cluster_basis(block)) {
      copy_basis(block_layout.column, std::uint64_t{block.column_rank} * block.column_count);
    }
  }
  const std::uint64_t entries = dense ? std::uint64_t{block.row_count} * block.column_count
                                      : std::uint64_t{block.row_rank} * block.column_rank;
  Value* const coupling = to + layout.basis_value_count + block_layout.values;
  for (std::uint32_t matrix = 0; matrix < matrix_count; ++matrix) {
    for (std::uint64_t k = 0; k < entries; ++k) coupling[k * matrix_count + matrix] = *from++;
  }
}

/// `streamed` has the blocks of `storage` as they are in the order kStreamed.
template <typename Value>
SharedArray<Value> stream_array(const Storage& storage, const Storage& in_order,
                                const SharedArray<Value>& values) {
  const HierarchicalLayout layout(in_order);
  const std::vector<TransferBlock>& blocks = in_order.blocks;
  std::vector<Value> streamed(
      HierarchicalLayout::padded(layout.basis_value_count + layout.coupling_value_count));
  const Value* from = values.data();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (has_values(blocks[b])) {
      copy_block(layout, blocks[b], layout.block_layouts[b], storage.matrix_count, from,
                 streamed.data());
    }
    from += storage.blocks[b].value_count(storage.matrix_count);
  }
  return SharedArray(std::move(streamed));
}

/// Divides all entries, and the steps that they are rounded to, by the smallest power of four that
/// brings them into the range of halves, and multiplies the scales of positions to match. Does
/// nothing if the operator has no such scales.
void fit_halves(Storage& exact) {
  if (exact.scale_exponent.empty()) return;
  // Half of the range of a half: rounding the bases makes entries of coupling matrices a little
  // larger.
  constexpr float kMost = 65504 / HierarchicalFormat::kHalfScale / 2;
  const std::uint64_t begin = HierarchicalLayout(exact).basis_value_count;
  float largest = 0;
  for (const float entry : exact.values_f32.span().subspan(begin)) {
    largest = std::max(largest, std::abs(entry));
  }
  if (!(largest > kMost) || !std::isfinite(largest)) return;
  const int power = static_cast<int>(std::ceil(std::log2(largest / kMost) / 2));
  std::vector<float> values(exact.values_f32.begin(), exact.values_f32.end());
  for (float& entry : std::span(values).subspan(begin)) entry = std::ldexp(entry, -2 * power);
  for (TransferBlock& block : exact.blocks) {
    block.coupling_step = std::ldexp(block.coupling_step, -2 * power);
  }
  for (std::int8_t& exponent : exact.scale_exponent) {
    exponent = static_cast<std::int8_t>(exponent + power);
  }
  exact.values_f32 = SharedArray(std::move(values));
}

/// The operator in the order kStreamed. Throws Error unless its values are in f32: others cannot be
/// rounded again.
Storage stream_exact(const Storage& storage) {
  Storage streamed = stream_values(storage);
  if (streamed.precision != hierarchical_precision(Precision::kF32)) {
    throw Error("hierarchical operator: values in " + precision_name(streamed.precision) +
                " cannot be rounded again; give them in f32");
  }
  return streamed;
}

// The largest magnitude of the integers that bases are rounded to.
constexpr float kLargestByte = 127;

/// Writes an operator in f32 in another precision. Where bases become integers, the scales of their
/// vectors are multiplied into the coupling matrices, and these are packed.
template <typename Basis, typename Coupling>
class Encoder {
 public:
  /// `bases` and `couplings` have room for all values and hold zeros; `rows` for packed coupling
  /// matrices.
  Encoder(const Storage& exact, const Storage& rounded, Basis* bases, Coupling* couplings,
          RowPacking& rows)
      : exact_(exact.values_f32.data()),
        matrix_count_(exact.matrix_count),
        from_(exact),
        to_(rounded),
        position_count_(HierarchicalFormat::position_count(exact.area.size())),
        exact_coefficient_scale_(exact.coefficient_scale),
        coefficient_scale_(exact.coefficient_scale),
        bases_(bases),
        couplings_(couplings),
        rows_(rows) {
    for (std::size_t b = 0; b < exact.blocks.size(); ++b) encode(exact.blocks[b], b);
  }

  std::vector<float> release_coefficient_scale() { return std::move(coefficient_scale_); }

 private:
  static constexpr bool kIntegers = std::is_same_v<Basis, std::int8_t>;

  void encode(const TransferBlock& block, std::size_t index) {
    const Layout::BlockLayout &from = from_.block_layouts[index], &to = to_.block_layouts[index];
    const float* coupling = exact_ + from_.basis_value_count + from.values;
    Coupling* encoded = couplings_ + to.values;
    if (block.kind == TransferBlock::Kind::kDense) {
      for (std::uint64_t k = 0; k < block.value_count(matrix_count_); ++k) {
        store_coupling(coupling[k], encoded[k]);
      }
    } else if (has_values(block)) {
      const EndScales rows =
          encode_basis(from.row, to.row, block.row_rank, {block.row_begin, block.row_count});
      if (is_cluster_basis(block)) {
        for (const float row : rows.scale) coefficient_scale_[next_coefficient_++] *= row;
        return;
      }
      const EndScales columns = encode_basis(from.column, to.column, block.column_rank,
                                             {block.column_begin, block.column_count});
      const std::size_t row_size = block.column_rank * matrix_count_;
      for (std::uint32_t r = 0; r < block.row_rank; ++r, coupling += row_size) {
        if constexpr (kIntegers) {
          pack({coupling, row_size}, rows.scale[r], columns.scale,
               block.coupling_step * rows.relative[r] * common_factor(columns.relative));
        } else {
          for (std::size_t k = 0; k < row_size; ++k) store_coupling(coupling[k], *encoded++);
        }
      }
    }
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

  EndScales encode_basis(const Layout::End& from, const Layout::End& to, std::size_t rank,
                         const Range& range) {
    EndScales scales{std::vector<float>(rank, 1.0F), std::vector<double>(rank, 1.0)};
    std::vector<float> vector(range.count);
    for (std::size_t r = 0; r < rank; ++r) {
      std::copy_n(exact_ + from_.basis_index(from, r, 0), range.count, vector.begin());
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

  const float* exact_;
  std::uint32_t matrix_count_;
  Layout from_, to_;
  std::size_t position_count_;
  std::span<const float> exact_coefficient_scale_;
  std::vector<float> coefficient_scale_;
  std::size_t next_coefficient_ = 0;  ///< index of the next cluster coefficient
  Basis* bases_;
  Coupling* couplings_;
  RowPacking& rows_;
};

/// A format, not yet known, for each row of the coupling matrices.
std::vector<std::uint8_t> rows_to_pack(const Storage& storage) {
  std::size_t count = 0;
  for (const TransferBlock& block : storage.blocks) {
    if (block.kind == TransferBlock::Kind::kLowRank) count += block.row_rank;
  }
  return std::vector<std::uint8_t>(count);
}

/// Rounds `exact`, in f32 and in the order kStreamed, to `precision`.
Storage rounded_to(const HierarchicalPrecision& precision, const Storage& exact) {
  Storage rounded = exact;
  rounded.precision = precision;
  rounded.values_f32 = {};
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
        Encoder<Basis, Coupling> encoder(exact, rounded, basis_values.data(), coupling_values,
                                         rows);
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
  Storage streamed = storage;
  streamed.order = Order::kStreamed;
  for (TransferBlock& block : streamed.blocks) {
    if (is_cluster_basis(block)) continue;
    if (block.row_rank == 0 || block.column_rank == 0) block.row_rank = block.column_rank = 0;
  }
  with_bases(streamed, [&](auto& array) { array = stream_array(storage, streamed, array); });
  return streamed;
}

Storage encode_values(const Storage& storage, Precision precision) {
  Storage exact = stream_exact(storage);
  if (precision == Precision::kF32) return exact;
  fit_halves(exact);
  return rounded_to(hierarchical_precision(precision), exact);
}

}  // namespace rebounce
