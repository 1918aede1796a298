#include "runtime/gpu/gpu_operator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "rebounce/error.h"
#include "transfer/base/half_float.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_values.h"
#include "transfer/format/row_format.h"

namespace rebounce {
namespace {

using Words4 = GpuOperator::Words4;
constexpr std::uint32_t kStrip = GpuOperator::kStrip;

// Vectors that are interleaved, and groups of them that one work group projects.
constexpr std::uint32_t kGroup = 4, kGroupsPerItem = 4;
// Words of one group of vectors in a strip.
constexpr std::uint32_t kNarrowWords = kStrip, kWideWords = 2 * kStrip;

constexpr double kLargestNarrow = 127, kLargestWide = 32767;
// Of a step: what rounding to float takes from a value that was stored in bytes.
constexpr double kSlack = 4e-3;

std::uint32_t checked_index(std::uint64_t count) {
  if (count > std::numeric_limits<std::uint32_t>::max() / 2) {
    throw Error("the operator is too large for the graphics card; use a coarser tolerance");
  }
  return static_cast<std::uint32_t>(count);
}

template <typename T>
std::uint32_t size_of(const std::vector<T>& list) {
  return checked_index(list.size());
}

std::uint32_t groups_of(std::uint32_t vectors) {
  return (vectors + kGroup - 1) / kGroup;
}

/// One vector of a basis: `place` counts the vectors of one end of a block.
struct BasisVector {
  std::uint32_t block;
  bool of_columns;
  std::uint32_t place;
  bool is_wide = false;
};

/// Basis vectors over one range of slots.
struct BasisSet {
  std::uint32_t begin, size;
  std::vector<BasisVector> vectors;
};

double largest_magnitude(std::span<const float> values) {
  double largest = 0;
  for (const float value : values) largest = std::max(largest, std::abs(double{value}));
  return largest;
}

bool fits_8_bits(std::span<const float> values) {
  const double largest = largest_magnitude(values);
  return std::ranges::all_of(values, [&](float value) {
    const double integer = value * (kLargestNarrow / largest);
    return largest == 0 || std::abs(integer - std::round(integer)) < kSlack;
  });
}

/// The integer that stands for 1 in 16 bits: that of bytes with a residual, where all values are
/// multiples of it, so that they stay what the processor has.
double wide_scale(std::span<const float> values) {
  constexpr double kOfBytes =
      double{HierarchicalFormat::kByteScale} * double{HierarchicalFormat::kResidualScale};
  const double largest = largest_magnitude(values);
  const bool are_multiples =
      largest * kOfBytes <= kLargestWide && std::ranges::all_of(values, [](float value) {
        return std::abs(value * kOfBytes - std::round(value * kOfBytes)) < kSlack;
      });
  return are_multiples ? kOfBytes : kLargestWide / largest;
}

class Tables {
 public:
  explicit Tables(const HierarchicalStorage& storage)
      : storage_(decode(storage)),
        layout_(storage_),
        are_floats_(storage.precision.couplings == CouplingPrecision::kF32),
        row_format_(storage.row_format),
        end_slots_(storage_.blocks.size()) {
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      end_slots_[b][0].resize(storage_.blocks[b].row_rank);
      end_slots_[b][1].resize(storage_.blocks[b].column_rank);
    }
  }

  GpuOperator make() {
    place_positions();
    const std::vector<BasisSet> sets = find_sets();
    for (const BasisSet& set : sets) add_set(set);
    result_.scales.resize(result_.scales.size() + kGroup);  // groups end after the last vector
    add_projections();
    add_couplings();
    add_dense_blocks();
    add_strips();
    return std::move(result_);
  }

 private:
  using EndSlots = std::array<std::vector<std::uint32_t>, 2>;  // of rows, of columns

  /// What a set adds to the work on its strips.
  struct PlacedSet {
    std::uint32_t begin, strips, word, slot, wide_count, count;

    std::uint32_t wide_groups() const { return groups_of(wide_count); }
    std::uint32_t narrow_groups() const { return groups_of(count) - wide_groups(); }
    std::uint32_t strip_words() const {
      return wide_groups() * kWideWords + narrow_groups() * kNarrowWords;
    }
  };

  void place_positions() {
    const std::size_t n = storage_.area.size();
    result_.channel_matrix = storage_.channel_matrix;
    result_.position_count = checked_index(HierarchicalFormat::position_count(n));
    const std::uint32_t clusters = layout_.cluster_coefficient_count;
    const std::uint32_t cluster_strips = (clusters + kStrip - 1) / kStrip;
    result_.first_coefficient = result_.position_count + cluster_strips * kStrip;
    result_.positions.resize(result_.position_count, {GpuOperator::kNoPatch, 0});
    result_.scales.resize(result_.first_coefficient);
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t p = storage_.patch[k];
      const float root = std::sqrt(storage_.area[p]), scale = storage_.position_scale(k);
      const float weight = storage_.roles.is_source(p) ? scale * root : 0;
      result_.positions[k] = {p, std::bit_cast<std::uint32_t>(weight)};
      result_.scales[k] = storage_.roles.is_receiver(p) ? scale / root : 0;
    }
    strip_bases_.resize(result_.first_coefficient / kStrip);
    strip_blocks_.resize(result_.first_coefficient / kStrip);
  }

  const HierarchicalLayout::End& end_of(const BasisVector& vector) const {
    const HierarchicalLayout::BlockLayout& block = layout_.block_layouts[vector.block];
    return vector.of_columns ? block.column : block.row;
  }

  std::vector<float> values_of(const BasisSet& set, const BasisVector& vector) const {
    std::vector<float> values(set.size);
    for (std::uint32_t k = 0; k < set.size; ++k) {
      values[k] = storage_.values_f32[layout_.basis_index(end_of(vector), vector.place, k)];
    }
    return values;
  }

  float coupling(std::uint64_t index) const {
    return storage_.values_f32[storage_.first_coupling(layout_.basis_value_count) + index];
  }

  /// One set for each cluster and one for each cluster basis, whose slots are given.
  std::vector<BasisSet> find_sets() const {
    std::vector<BasisSet> sets, cluster_bases;
    for (const HierarchicalLayout::Cluster& cluster : layout_.clusters)
      sets.push_back({.begin = cluster.begin, .size = cluster.size, .vectors = {}});
    const auto add = [](BasisSet& set, std::uint32_t b, bool of_columns, std::uint32_t rank) {
      for (std::uint32_t k = 0; k < rank; ++k)
        set.vectors.push_back({.block = b, .of_columns = of_columns, .place = k});
    };
    for (std::uint32_t b = 0; b < storage_.blocks.size(); ++b) {
      const TransferBlock& block = storage_.blocks[b];
      const HierarchicalLayout::BlockLayout& ends = layout_.block_layouts[b];
      if (block.kind == TransferBlock::Kind::kDense || !has_values(block)) continue;
      if (is_cluster_basis(block)) {
        cluster_bases.push_back({.begin = block.row_begin, .size = block.row_count, .vectors = {}});
        add(cluster_bases.back(), b, false, block.row_rank);
        continue;
      }
      add(sets[ends.row.cluster], b, false, block.row_rank);
      if (!block.on_diagonal()) add(sets[ends.column.cluster], b, true, block.column_rank);
    }
    for (BasisSet& set : sets) find_wide(set);
    for (BasisSet& set : sets) {
      std::stable_partition(set.vectors.begin(), set.vectors.end(),
                            [](const BasisVector& v) { return v.is_wide; });
    }
    for (BasisSet& set : cluster_bases) find_wide(set);
    std::ranges::move(cluster_bases, std::back_inserter(sets));
    std::erase_if(sets, [](const BasisSet& set) { return set.vectors.empty(); });
    return sets;
  }

  void find_wide(BasisSet& set) const {
    for (BasisVector& vector : set.vectors) vector.is_wide = !fits_8_bits(values_of(set, vector));
  }

  /// Vectors of cluster bases keep their order, so narrow ones before a wide one are wide too, as
  /// are those that share its group.
  static std::uint32_t wide_vectors(const BasisSet& set) {
    std::uint32_t last = 0;
    for (std::uint32_t k = 0; k < set.vectors.size(); ++k) {
      if (set.vectors[k].is_wide) last = k + 1;
    }
    return std::min(groups_of(last) * kGroup, size_of(set.vectors));
  }

  void add_set(const BasisSet& set) {
    const TransferBlock& first = storage_.blocks[set.vectors.front().block];
    const bool is_basis = is_cluster_basis(first);
    const PlacedSet placed{
        .begin = set.begin,
        .strips = set.size / kStrip,
        .word = size_of(result_.bases),
        .slot = is_basis ? first.column_begin : size_of(result_.scales),
        .wide_count = wide_vectors(set),
        .count = size_of(set.vectors),
    };
    const std::uint64_t words = std::uint64_t{placed.strips} * placed.strip_words();
    result_.bases.resize(checked_index(placed.word + words));
    if (!is_basis) result_.scales.resize(placed.slot + placed.count);
    for (std::uint32_t v = 0; v < placed.count; ++v) {
      const BasisVector& vector = set.vectors[v];
      double step = store(placed, v, values_of(set, vector));
      if (is_basis) {
        step *= storage_.coefficient_scale[placed.slot + v - result_.position_count];
      } else {
        end_slots_[vector.block][vector.of_columns ? 1 : 0][vector.place] = placed.slot + v;
      }
      result_.scales[placed.slot + v] = static_cast<float>(step);
    }
    for (std::uint32_t s = 0; s < placed.strips; ++s) {
      strip_bases_[set.begin / kStrip + s].push_back({placed.word + s * placed.strip_words(),
                                                      placed.slot, placed.wide_groups(),
                                                      placed.narrow_groups()});
    }
    sets_.push_back(placed);
  }

  /// Stores a vector as integers and returns its step.
  double store(const PlacedSet& set, std::uint32_t vector, std::span<const float> values) {
    const bool is_wide = vector < set.wide_count;
    const double largest = largest_magnitude(values);
    if (largest == 0) return 0;
    const double per_step = is_wide ? wide_scale(values) : kLargestNarrow / largest;
    const std::uint32_t group = vector / kGroup, lane = vector % kGroup;
    for (std::uint32_t k = 0; k < values.size(); ++k) {
      const auto integer = static_cast<std::int32_t>(std::lround(values[k] * per_step));
      const std::uint64_t strip = set.word + std::uint64_t{k / kStrip} * set.strip_words();
      if (is_wide) {
        const std::uint64_t word = strip + group * kWideWords + 2 * (k % kStrip) + lane / 2;
        result_.bases[word] |= (static_cast<std::uint32_t>(integer) & 0xFFFFU) << (lane % 2 * 16);
      } else {
        const std::uint64_t word = strip + set.wide_groups() * kWideWords +
                                   (group - set.wide_groups()) * kNarrowWords + k % kStrip;
        result_.bases[word] |= (static_cast<std::uint32_t>(integer) & 0xFFU) << (lane * 8);
      }
    }
    return 1 / per_step;
  }

  void add_projections() {
    for (const bool of_positions : {true, false}) {
      for (const PlacedSet& set : sets_) {
        if ((set.begin < result_.position_count) == of_positions) add_projections_of(set);
      }
      if (of_positions) result_.position_projections = size_of(result_.projections) / 2;
    }
  }

  void add_projections_of(const PlacedSet& set) {
    const auto add = [&](std::uint32_t first, std::uint32_t last, std::uint32_t word,
                         std::uint32_t group_words, bool is_wide) {
      for (std::uint32_t v = first; v < last; v += kGroup * kGroupsPerItem) {
        result_.projections.push_back(
            {word + (v - first) / kGroup * group_words, set.begin, set.strips, set.strip_words()});
        result_.projections.push_back(
            {set.slot + v, std::min(last - v, kGroup * kGroupsPerItem), is_wide ? 1U : 0U, 0});
      }
    };
    add(0, set.wide_count, set.word, kWideWords, true);
    add(set.wide_count, set.count, set.word + set.wide_groups() * kWideWords, kNarrowWords, false);
  }

  /// The entries of a block among all.
  struct Entries {
    std::uint32_t first;
    GpuOperator::EntryFormat format;
    float scale = 1;

    Words4 strides(std::uint32_t output, std::uint32_t input) const {
      return {output, input, std::bit_cast<std::uint32_t>(scale),
              static_cast<std::uint32_t>(format)};
    }
  };

  /// Appends the entries of a block, [matrix][count]: value_of(k, matrix) is entry k.
  template <typename ValueOf>
  std::uint32_t add_values(GpuOperator::EntryFormat format, std::uint64_t count,
                           const ValueOf& value_of) {
    const std::uint64_t per_word = format == GpuOperator::EntryFormat::kFloat ? 1 : 2;
    const std::uint64_t first = result_.couplings.size() * per_word;
    const std::uint64_t last = checked_index(first + count * storage_.matrix_count);
    result_.couplings.resize((last + per_word - 1) / per_word);
    for (std::uint64_t k = 0; k < count; ++k) {
      for (std::uint32_t m = 0; m < storage_.matrix_count; ++m) {
        const std::uint64_t entry = first + m * count + k;
        const float value = value_of(k, m);
        std::uint32_t& word = result_.couplings[entry / per_word];
        switch (format) {
          case GpuOperator::EntryFormat::kHalf:
            word |= std::uint32_t{float_to_half(value)} << (entry % 2 * 16);
            break;
          case GpuOperator::EntryFormat::kInteger:
            word |= (static_cast<std::uint32_t>(std::lround(value)) & 0xFFFFU) << (entry % 2 * 16);
            break;
          case GpuOperator::EntryFormat::kFloat:
            word = std::bit_cast<std::uint32_t>(value);
            break;
        }
      }
    }
    return static_cast<std::uint32_t>(first);
  }

  /// Appends the entries of a block as floats or halves.
  Entries add_entries(std::uint64_t values, std::uint64_t count, bool as_floats) {
    const int exponent = as_floats ? 0 : half_exponent(values, count * storage_.matrix_count);
    const auto format =
        as_floats ? GpuOperator::EntryFormat::kFloat : GpuOperator::EntryFormat::kHalf;
    const auto value_of = [&](std::uint64_t k, std::uint32_t m) {
      return std::ldexp(coupling(values + k * storage_.matrix_count + m), exponent);
    };
    return {add_values(format, count, value_of), format, std::ldexp(1.0F, -exponent)};
  }

  /// Appends the integers of a packed coupling matrix. The slots of its rows take their steps.
  Entries add_packed(std::uint64_t values, const TransferBlock& block,
                     std::span<const std::uint8_t> formats,
                     std::span<const std::uint32_t> row_slots) {
    std::vector<float> step;
    for (const std::uint8_t format : formats) {
      step.push_back(RowFormat{format}.step() / HierarchicalFormat::kHalfScale);
      result_.scales[row_slots[step.size() - 1]] *= step.back();
    }
    const auto value_of = [&](std::uint64_t k, std::uint32_t m) {
      return coupling(values + k * storage_.matrix_count + m) / step[k / block.column_rank];
    };
    constexpr auto kFormat = GpuOperator::EntryFormat::kInteger;
    return {add_values(kFormat, std::uint64_t{block.row_rank} * block.column_rank, value_of),
            kFormat};
  }

  /// The power of two that takes the largest of these entries to the upper end of the range of
  /// halves.
  int half_exponent(std::uint64_t values, std::uint64_t count) const {
    double largest = 0;
    for (std::uint64_t k = 0; k < count; ++k)
      largest = std::max(largest, std::abs(double{coupling(values + k)}));
    constexpr int kExponent = 14;  // of the largest half, 65,504, less one bit
    return largest > 0 ? std::clamp(kExponent - std::ilogb(largest), -100, 100) : 0;
  }

  void add_couplings() {
    const auto coefficients = result_.scales.size() - kGroup - result_.first_coefficient;
    result_.outputs.resize(coefficients);
    std::size_t first_row = 0;  // of packed ones
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      const TransferBlock& block = storage_.blocks[b];
      if (block.kind != TransferBlock::Kind::kLowRank || !has_values(block)) continue;
      const std::uint32_t rows = block.row_rank, columns = block.column_rank;
      const auto& [row_slots, column_slots] = end_slots_[b];
      const std::uint64_t values = layout_.block_layouts[b].values;
      const bool is_packed = !row_format_.empty();
      const std::size_t row = std::exchange(first_row, first_row + (is_packed ? rows : 0));
      // On the diagonal, rows and columns have the same slots, but not the same steps.
      const Entries entries =
          is_packed && !block.on_diagonal()
              ? add_packed(values, block, row_format_.subspan(row, rows), row_slots)
              : add_entries(values, std::uint64_t{rows} * columns, are_floats_ || is_packed);
      const Words4 by_row = entries.strides(columns, 1);
      if (block.on_diagonal()) {
        add_side(row_slots, row_slots, entries.first, rows * columns, by_row);
        continue;
      }
      add_side(row_slots, column_slots, entries.first, rows * columns, by_row);
      add_side(column_slots, row_slots, entries.first, rows * columns, entries.strides(1, columns));
    }
  }

  void add_side(std::span<const std::uint32_t> outputs, std::span<const std::uint32_t> inputs,
                std::uint32_t values, std::uint32_t matrix_size, const Words4& strides) {
    const std::uint32_t side = size_of(result_.sides) / 2;
    result_.sides.push_back(
        {size_of(result_.inputs), static_cast<std::uint32_t>(inputs.size()), values, matrix_size});
    result_.sides.push_back(strides);
    result_.inputs.insert(result_.inputs.end(), inputs.begin(), inputs.end());
    for (std::uint32_t k = 0; k < outputs.size(); ++k)
      result_.outputs[outputs[k] - result_.first_coefficient] = {side, k};
  }

  void add_dense_blocks() {
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      const TransferBlock& block = storage_.blocks[b];
      if (block.kind != TransferBlock::Kind::kDense) continue;
      const std::uint32_t columns = block.column_count, size = block.row_count * columns;
      const Entries entries = add_entries(layout_.block_layouts[b].values,
                                          std::uint64_t{block.row_count} * columns, are_floats_);
      const std::uint32_t values = entries.first;
      for (std::uint32_t s = 0; s < block.row_count / kStrip; ++s) {
        auto& list = strip_blocks_[block.row_begin / kStrip + s];
        list.push_back({values + s * kStrip * columns, block.column_begin, columns, size});
        list.push_back(entries.strides(columns, 1));
      }
      if (block.on_diagonal()) continue;
      for (std::uint32_t s = 0; s < columns / kStrip; ++s) {
        auto& list = strip_blocks_[block.column_begin / kStrip + s];
        list.push_back({values + s * kStrip, block.row_begin, block.row_count, size});
        list.push_back(entries.strides(1, columns));
      }
    }
  }

  void add_strips() {
    std::vector<Words4>& entries = result_.strip_entries;
    for (std::size_t s = 0; s < strip_bases_.size(); ++s) {
      const std::uint32_t first = size_of(entries);
      entries.insert(entries.end(), strip_bases_[s].begin(), strip_bases_[s].end());
      const std::uint32_t middle = size_of(entries);
      entries.insert(entries.end(), strip_blocks_[s].begin(), strip_blocks_[s].end());
      result_.strips.push_back({first, middle, middle, size_of(entries)});
    }
  }

  HierarchicalStorage storage_;  // in f32
  HierarchicalLayout layout_;
  bool are_floats_;                           // coupling matrices and dense entries, as stored
  std::span<const std::uint8_t> row_format_;  // as stored
  std::vector<EndSlots> end_slots_;           // of the vectors of each block
  std::vector<PlacedSet> sets_;
  std::vector<std::vector<Words4>> strip_bases_, strip_blocks_;
  GpuOperator result_;
};

}  // namespace

GpuOperator make_gpu_operator(const HierarchicalStorage& storage) {
  return Tables(storage).make();
}

}  // namespace rebounce
