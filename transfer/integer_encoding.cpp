#include "integer_encoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <limits>
#include <span>
#include <vector>

#include "hierarchical_layout.h"
#include "hierarchical_storage.h"

namespace rebounce {
namespace {

using Storage = HierarchicalOperator::Storage;
using Layout = HierarchicalLayout;

// Squared error that a value of a remainder has to remove, in units of what a value of the last
// ranks removes. Below 1/2, as bytes are half of what the values of cores take. Measured:
// notes/operator.md.
constexpr double kRemainderWorth = 0.1;

double squared_norm(std::span<const float> vector) {
  double sum = 0;
  for (const float v : vector) sum += double{v} * double{v};
  return sum;
}

/// A kind of integers that bases are rounded to: their largest magnitude, and which of them stands
/// for 1.
template <typename Integer>
struct IntegerRange;
template <>
struct IntegerRange<std::int8_t> {
  static constexpr float kLargest = 127, kScale = HierarchicalOperator::kByteScale;
};
template <>
struct IntegerRange<std::int16_t> {
  static constexpr float kLargest = HierarchicalOperator::kLargestShort;
  static constexpr float kScale = HierarchicalOperator::kShortScale;
};

/// A basis as integers.
template <typename Integer>
struct IntegerBasis {
  std::vector<float> scale;  ///< [rank] what the vectors must be multiplied by, over kScale
  std::uint32_t remainders = 0;
  std::vector<Integer> values;  ///< [rank + remainders][size]
};

/// The squared sums of the entries of a core that each vector of its ends goes with.
struct CoreEnergies {
  std::vector<double> row, column;
};

/// The low-rank blocks of an operator in f32.
class ExactBlocks {
 public:
  explicit ExactBlocks(const Storage& storage) : storage_(storage), layout_(storage) {}

  static bool is_low_rank(const TransferBlock& block) {
    return block.kind == TransferBlock::Kind::kLowRank && has_values(block);
  }
  const float* core(std::size_t index) const {
    return storage_.values_f32.data() + layout_.basis_value_count + layout_.places[index].values;
  }
  const float* row_basis(std::size_t index) const { return basis(layout_.places[index].row); }
  const float* column_basis(std::size_t index) const { return basis(layout_.places[index].column); }

  CoreEnergies energies(std::size_t index) const {
    const TransferBlock& block = storage_.blocks[index];
    CoreEnergies energies{std::vector<double>(block.row_rank),
                          std::vector<double>(block.column_rank)};
    const float* entry = core(index);
    for (double& row : energies.row) {
      for (double& column : energies.column) {
        for (std::uint32_t matrix = 0; matrix < storage_.matrix_count; ++matrix) {
          const double squared = double{*entry} * double{*entry};
          row += squared;
          column += squared;
          ++entry;
        }
      }
    }
    return energies;
  }

  /// The squared error that a value of the last ranks removes: the median over all bases.
  double usual_worth() const {
    std::vector<double> worth;
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      const TransferBlock& block = storage_.blocks[b];
      if (!is_low_rank(block)) continue;
      const CoreEnergies energy = energies(b);
      worth.push_back(least_worth(row_basis(b), block.row_count, energy.row));
      worth.push_back(least_worth(column_basis(b), block.column_count, energy.column));
    }
    if (worth.empty()) return 0;
    const auto middle = worth.begin() + static_cast<std::ptrdiff_t>(worth.size() / 2);
    std::ranges::nth_element(worth, middle);
    return *middle;
  }

 private:
  /// Of the vectors of a basis [rank][size], the least squared error that one of its values
  /// removes.
  static double least_worth(const float* basis, std::size_t size, std::span<const double> energy) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t r = 0; r < energy.size(); ++r) {
      least = std::min(least, energy[r] * squared_norm(std::span(basis + r * size, size)));
    }
    return least / static_cast<double>(size);
  }

  const float* basis(const Layout::End& end) const {
    return storage_.values_f32.data() + layout_.basis_index(end, 0, 0);
  }

  const Storage& storage_;
  Layout layout_;
};

/// Rounds bases, with remainders where they are worth their values.
template <typename Integer>
class BasisRounding {
 public:
  /// A value of a remainder has to remove more squared error than `worth`.
  explicit BasisRounding(double worth) : worth_(worth) {}

  /// `energy` [rank] is that of the entries that each vector goes with.
  IntegerBasis<Integer> round(const float* basis, std::size_t size,
                              std::span<const double> energy) const {
    IntegerBasis<Integer> rounded;
    rounded.values.reserve(energy.size() * size);
    std::vector<float> rest(basis, basis + energy.size() * size);
    std::vector<float> steps;
    for (std::uint32_t r = 0; r < energy.size(); ++r) {
      const auto vector = std::span(rest).subspan(r * size, size);
      float largest = 0;
      for (const float v : vector) largest = std::max(largest, std::abs(v));
      steps.push_back(largest / kLargest);
      rounded.scale.push_back(steps.back() * IntegerRange<Integer>::kScale);
      take(vector, steps.back(), rounded.values);
      const double left = energy[r] * squared_norm(vector);
      if (left > worth_ * static_cast<double>(size)) rounded.remainders = r + 1;
    }
    for (std::uint32_t r = 0; r < rounded.remainders; ++r) {
      take(std::span(rest).subspan(r * size, size),
           steps[r] / HierarchicalOperator::kRemainderScale, rounded.values);
    }
    return rounded;
  }

 private:
  static constexpr float kLargest = IntegerRange<Integer>::kLargest;

  /// Appends a vector in multiples of `step`, and leaves what they are off.
  static void take(std::span<float> vector, float step, std::vector<Integer>& values) {
    for (float& v : vector) {
      const float steps = step > 0 ? std::clamp(std::round(v / step), -kLargest, kLargest) : 0;
      values.push_back(static_cast<Integer>(steps));
      v -= steps * step;
    }
  }

  double worth_;
};

template <typename Integer>
class IntegerEncoder {
 public:
  IntegerEncoder(const Storage& exact, double worth_factor)
      : exact_(exact), blocks_(exact), rows_(exact.blocks.size()), columns_(exact.blocks.size()) {
    const BasisRounding<Integer> rounding(worth_factor * blocks_.usual_worth());
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t b = 0; b < exact.blocks.size(); ++b) {
      const TransferBlock& block = exact.blocks[b];
      if (!ExactBlocks::is_low_rank(block)) continue;
      const CoreEnergies energy = blocks_.energies(b);
      rows_[b] = rounding.round(blocks_.row_basis(b), block.row_count, energy.row);
      if (block.on_diagonal()) continue;
      columns_[b] = rounding.round(blocks_.column_basis(b), block.column_count, energy.column);
    }
  }

  /// The operator with its bases in `bases`.
  Storage encode(Precision precision, SharedArray<Integer> Storage::*bases) const {
    Storage storage = exact_;
    storage.precision = precision;
    storage.values_f32 = {};
    for (std::size_t b = 0; b < storage.blocks.size(); ++b) {
      TransferBlock& block = storage.blocks[b];
      if (!ExactBlocks::is_low_rank(block)) continue;
      block.row_remainders = rows_[b].remainders;
      block.column_remainders = columns_of(b).remainders;
    }
    const Layout layout(storage);
    std::vector<Integer> values(Layout::padded(layout.basis_value_count));
    std::vector<std::uint16_t> cores(Layout::padded(layout.core_value_count));
    for (std::size_t b = 0; b < storage.blocks.size(); ++b) {
      const TransferBlock& block = storage.blocks[b];
      if (!has_values(block)) continue;
      const Layout::Place& place = layout.places[b];
      encode_core(b, cores.data() + place.values);
      if (block.kind == TransferBlock::Kind::kDense) continue;
      put(rows_[b], block.row_count, layout, place.row, values);
      if (!block.on_diagonal()) put(columns_[b], block.column_count, layout, place.column, values);
    }
    storage.*bases = SharedArray(std::move(values));
    storage.values_f16 = SharedArray(std::move(cores));
    return storage;
  }

 private:
  const IntegerBasis<Integer>& columns_of(std::size_t index) const {
    return exact_.blocks[index].on_diagonal() ? rows_[index] : columns_[index];
  }

  static void put(const IntegerBasis<Integer>& basis, std::size_t size, const Layout& layout,
                  const Layout::End& end, std::vector<Integer>& values) {
    for (std::size_t r = 0; r < basis.scale.size() + basis.remainders; ++r) {
      for (std::size_t k = 0; k < size; ++k) {
        values[layout.basis_index(end, r, k)] = basis.values[r * size + k];
      }
    }
  }

  /// The core that makes up for the scales of its bases, or the entries of a dense block.
  void encode_core(std::size_t index, std::uint16_t* to) const {
    const TransferBlock& block = exact_.blocks[index];
    const float* const from = blocks_.core(index);
    const std::uint32_t matrices = exact_.matrix_count;
    if (block.kind == TransferBlock::Kind::kDense) {
      std::transform(from, from + block.value_count(matrices), to, encode_core_value);
      return;
    }
    const IntegerBasis<Integer>&rows = rows_[index], &columns = columns_of(index);
    const float* entry = from;
    for (const float row : rows.scale) {
      for (const float column : columns.scale) {
        for (std::uint32_t matrix = 0; matrix < matrices; ++matrix) {
          *to++ = encode_core_value(*entry++ * row * column);
        }
      }
    }
  }

  const Storage& exact_;
  ExactBlocks blocks_;
  std::vector<IntegerBasis<Integer>> rows_, columns_;  ///< by block
};

}  // namespace

Storage encode_integers(const Storage& exact, Precision precision) {
  if (precision == Precision::kQ8) {
    return IntegerEncoder<std::int8_t>(exact, kRemainderWorth)
        .encode(precision, &Storage::bases_q8);
  }
  constexpr double kNever = std::numeric_limits<double>::infinity();
  return IntegerEncoder<std::int16_t>(exact, kNever).encode(precision, &Storage::bases_q16);
}

}  // namespace rebounce
