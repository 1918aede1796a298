#include "hierarchical_storage.h"

#include <algorithm>
#include <cmath>

#include "half_float.h"
#include "hierarchical_layout.h"
#include "integer_encoding.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Storage = HierarchicalOperator::Storage;

constexpr std::size_t kAlignment = HierarchicalOperator::kAlignment;

[[noreturn]] void refuse(const std::string& reason) {
  throw Error("hierarchical operator: " + reason);
}

void check_permutation(std::span<const std::uint32_t> patch, std::size_t patch_count) {
  if (patch.size() != patch_count) refuse("not one position for each patch");
  std::vector<bool> seen(patch_count, false);
  for (const std::uint32_t p : patch) {
    if (p >= patch_count || seen[p]) refuse("the order of patches is not a permutation");
    seen[p] = true;
  }
}

void check_exponents(std::span<const std::int8_t> exponents, std::size_t patch_count) {
  if (!exponents.empty() && exponents.size() != patch_count) {
    refuse("not one scale for each position");
  }
  constexpr int kLargest = HierarchicalOperator::kLargestExponent;
  if (std::ranges::any_of(exponents, [](int e) { return e < -kLargest || e > kLargest; })) {
    refuse("a scale of a position is beyond 2^+-" + std::to_string(kLargest));
  }
}

/// Positions of patches, with their padding, and the moments that are numbered after them.
struct Places {
  std::size_t position_count, moment_count;

  /// Whether [begin, begin + count) is a cluster's range of positions.
  bool are_positions(std::uint64_t begin, std::uint64_t count) const {
    return are_aligned(begin, count) && begin + count <= position_count;
  }
  bool are_moments(std::uint64_t begin, std::uint64_t count) const {
    return are_aligned(begin, count) && begin >= position_count &&
           begin + count <= position_count + moment_count;
  }

 private:
  static bool are_aligned(std::uint64_t begin, std::uint64_t count) {
    return count > 0 && begin % kAlignment == 0 && count % kAlignment == 0;
  }
};

void check_moments(const TransferBlock& block, const Places& places) {
  if (!places.are_positions(block.row_begin, block.row_count))
    refuse("moments are of no positions");
  if (block.row_rank != block.column_count || block.row_rank > block.row_count ||
      block.column_rank != 0 || block.row_remainders > block.row_rank ||
      block.column_remainders != 0) {
    refuse("the rank of moments does not fit their number");
  }
}

void check_block(const TransferBlock& block, const Places& places) {
  if (is_moments(block)) return check_moments(block, places);
  const auto is_range = [&](std::uint32_t begin, std::uint32_t count) {
    return places.are_positions(begin, count) ||
           (block.kind == TransferBlock::Kind::kLowRank && places.are_moments(begin, count));
  };
  if (!is_range(block.row_begin, block.row_count) ||
      !is_range(block.column_begin, block.column_count)) {
    refuse("a block is empty, not aligned or reaches outside the matrix");
  }
  const bool misplaced = block.on_diagonal()
                             ? block.row_count != block.column_count
                             : block.column_begin + block.column_count > block.row_begin;
  if (misplaced) refuse("a block is neither on the diagonal nor below it");
  switch (block.kind) {
    case TransferBlock::Kind::kDense:
      if ((block.row_rank | block.column_rank | block.row_remainders | block.column_remainders) !=
          0) {
        refuse("a dense block has a rank");
      }
      return;
    case TransferBlock::Kind::kLowRank:
      if (block.row_rank > block.row_count || block.column_rank > block.column_count ||
          (block.on_diagonal() && block.row_rank != block.column_rank)) {
        refuse("the ranks of a block do not fit its size");
      }
      if (block.row_remainders > block.row_rank || block.column_remainders > block.column_rank ||
          (block.on_diagonal() && block.row_remainders != block.column_remainders)) {
        refuse("the remainders of a block do not fit its ranks");
      }
      return;
    case TransferBlock::Kind::kMoments:
      return;
  }
  refuse("a block is of an unknown kind");
}

/// Of the blocks of moments, which must be numbered in their order; their scales must be there.
std::size_t checked_moment_count(const Storage& storage, std::size_t position_count) {
  std::uint64_t end = position_count;
  for (const TransferBlock& block : storage.blocks) {
    if (!is_moments(block)) continue;
    if (block.column_begin != end) refuse("moments are not numbered in the order of their blocks");
    end += block.column_count;
  }
  if (storage.moment_scale.size() != end - position_count) refuse("not one scale for each moment");
  if (!std::ranges::all_of(storage.moment_scale, [](float s) { return std::isfinite(s); })) {
    refuse("a scale of a moment is not finite");
  }
  return end - position_count;
}

void check_tables(const Storage& storage) {
  const std::size_t n = storage.area.size();
  if (n == 0) refuse("there are no patches");
  if (storage.matrix_count < 1 || storage.matrix_count > kChannelCount) {
    refuse("not 1, 2 or 3 matrices");
  }
  for (const std::uint32_t matrix : storage.channel_matrix) {
    if (matrix >= storage.matrix_count) refuse("a channel has no matrix");
  }
  check_permutation(storage.patch, n);
  check_exponents(storage.scale_exponent, n);
  try {
    check_roles(storage.roles, n);
  } catch (const Error& error) {
    refuse(error.what());
  }
  const std::size_t positions = HierarchicalOperator::position_count(n);
  const Places places{positions, checked_moment_count(storage, positions)};
  for (const TransferBlock& block : storage.blocks) {
    check_block(block, places);
    const bool one_rank = !is_moments(block) && (block.row_rank == 0) != (block.column_rank == 0);
    if (one_rank && storage.order == HierarchicalOperator::Order::kStreamed) {
      refuse("a block has only one rank");
    }
    const bool rounded =
        storage.precision == Precision::kF16 || storage.precision == Precision::kQ16;
    if (rounded && (block.row_remainders | block.column_remainders) != 0) {
      refuse("a block has remainders, which are for bases in 8 bits alone");
    }
  }
}

std::uint64_t block_order_count(const Storage& storage) {
  std::uint64_t count = HierarchicalOperator::kPadding;
  for (const TransferBlock& block : storage.blocks)
    count += block.value_count(storage.matrix_count);
  return count;
}

/// Copies the values of one block from where it begins to where they belong.
template <typename Value>
void place_block(const HierarchicalLayout& layout, const TransferBlock& block,
                 const HierarchicalLayout::Place& place, std::uint32_t matrix_count,
                 const Value* from, Value* to) {
  const bool dense = block.kind == TransferBlock::Kind::kDense;
  const auto copy_basis = [&](const HierarchicalLayout::End& end, std::uint64_t count) {
    std::copy_n(from, count, to + layout.basis_index(end, 0, 0));
    from += count;
  };
  if (!dense) {
    copy_basis(place.row, std::uint64_t{block.row_rank} * block.row_count);
    if (!block.on_diagonal() && !is_moments(block)) {
      copy_basis(place.column, std::uint64_t{block.column_rank} * block.column_count);
    }
  }
  const std::uint64_t entries = dense ? std::uint64_t{block.row_count} * block.column_count
                                      : std::uint64_t{block.row_rank} * block.column_rank;
  Value* const core = to + layout.basis_value_count + place.values;
  for (std::uint32_t matrix = 0; matrix < matrix_count; ++matrix) {
    for (std::uint64_t k = 0; k < entries; ++k) core[k * matrix_count + matrix] = *from++;
  }
}

template <typename Value>
SharedArray<Value> stream_values(const Storage& storage, const std::vector<TransferBlock>& blocks,
                                 const SharedArray<Value>& values) {
  const HierarchicalLayout layout(blocks, storage.matrix_count, storage.precision);
  std::vector<Value> streamed(
      HierarchicalLayout::padded(layout.basis_value_count + layout.core_value_count));
  const Value* from = values.data();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (has_values(blocks[b])) {
      place_block(layout, blocks[b], layout.places[b], storage.matrix_count, from, streamed.data());
    }
    from += storage.blocks[b].value_count(storage.matrix_count);
  }
  return SharedArray(std::move(streamed));
}

/// Numbers of values that the arrays must have.
struct ArraySizes {
  std::uint64_t f32 = 0, f16 = 0, q16 = 0, q8 = 0;
  bool operator==(const ArraySizes&) const = default;
};

ArraySizes expected_sizes(const Storage& storage) {
  const HierarchicalLayout layout(storage);
  const std::uint64_t bases = HierarchicalLayout::padded(layout.basis_value_count);
  const std::uint64_t cores = HierarchicalLayout::padded(layout.core_value_count);
  if (storage.precision == Precision::kQ16) return {.f16 = cores, .q16 = bases};
  if (storage.precision == Precision::kQ8) return {.f16 = cores, .q8 = bases};
  const std::uint64_t all =
      storage.order == HierarchicalOperator::Order::kStreamed
          ? HierarchicalLayout::padded(layout.basis_value_count + layout.core_value_count)
          : block_order_count(storage);
  if (storage.precision == Precision::kF16) return {.f16 = all};
  return {.f32 = all};
}

/// Makes all entries so much smaller by powers of four that halves hold them, and scales of
/// positions, if there are any, as much larger.
void fit_halves(Storage& exact) {
  if (exact.scale_exponent.empty()) return;
  // Half of what they hold: entries of cores grow a little with the rounding of their bases.
  constexpr float kMost = 65504 / HierarchicalOperator::kHalfScale / 2;
  const std::uint64_t begin = HierarchicalLayout(exact).basis_value_count;
  float largest = 0;
  for (const float entry : exact.values_f32.span().subspan(begin)) {
    largest = std::max(largest, std::abs(entry));
  }
  if (!(largest > kMost) || !std::isfinite(largest)) return;
  const int power = static_cast<int>(std::ceil(std::log2(largest / kMost) / 2));
  std::vector<float> values(exact.values_f32.begin(), exact.values_f32.end());
  for (float& entry : std::span(values).subspan(begin)) entry = std::ldexp(entry, -2 * power);
  for (std::int8_t& exponent : exact.scale_exponent) {
    exponent = static_cast<std::int8_t>(exponent + power);
  }
  exact.values_f32 = SharedArray(std::move(values));
}

/// Values in f32, which can be rounded, in the order kStreamed.
Storage stream_exact(const Storage& storage) {
  if (storage.precision != Precision::kF32) {
    refuse(std::string("values in ") + precision_name(storage.precision) +
           " cannot be rounded again; give them in f32");
  }
  return HierarchicalOperator::stream(storage);
}

/// The same within the range of halves, as far as scales of positions allow.
Storage stream_for_halves(const Storage& storage) {
  Storage exact = stream_exact(storage);
  fit_halves(exact);
  return exact;
}

}  // namespace

std::uint64_t TransferBlock::value_count(std::uint32_t matrix_count) const {
  const std::uint64_t rows = row_count, columns = column_count;
  if (kind == Kind::kDense) return matrix_count * rows * columns;
  const std::uint64_t column_basis = on_diagonal() ? 0 : columns * column_rank;
  return rows * row_rank + column_basis +
         std::uint64_t{matrix_count} * row_rank * std::uint64_t{column_rank};
}

void check_hierarchical_storage(const Storage& storage) {
  check_tables(storage);
  if (has_integer_bases(storage.precision) &&
      storage.order != HierarchicalOperator::Order::kStreamed) {
    refuse("integers are for streamed values alone");
  }
  const ArraySizes sizes{storage.values_f32.size(), storage.values_f16.size(),
                         storage.bases_q16.size(), storage.bases_q8.size()};
  if (sizes != expected_sizes(storage)) refuse("the number of values does not fit the blocks");
  // Sums of their products must not overflow.
  constexpr std::int16_t kLargest = HierarchicalOperator::kLargestShort;
  const auto too_large = [](std::int16_t value) { return value > kLargest || value < -kLargest; };
  if (std::ranges::any_of(storage.bases_q16.span(), too_large)) {
    refuse("a value of the bases is beyond +-" + std::to_string(kLargest));
  }
}

std::uint16_t encode_core_value(float value) {
  const std::uint16_t half = float_to_half(value * HierarchicalOperator::kHalfScale);
  if ((half & 0x7FFFU) >= 0x7C00U) {
    throw Error("an entry of the operator is too large for f16; use --precision f32");
  }
  return half;
}

float position_scale(const Storage& storage, std::size_t position) {
  return storage.scale_exponent.empty() ? 1 : std::ldexp(1.0F, storage.scale_exponent[position]);
}

void drop_remainders(Storage& storage) {
  for (TransferBlock& block : storage.blocks) block.row_remainders = block.column_remainders = 0;
}

Storage HierarchicalOperator::stream(const Storage& storage) {
  check_hierarchical_storage(storage);
  if (storage.order == Order::kStreamed) return storage;
  Storage streamed = storage;
  streamed.order = Order::kStreamed;
  for (TransferBlock& block : streamed.blocks) {
    if (is_moments(block)) continue;
    if (block.row_rank == 0 || block.column_rank == 0) block.row_rank = block.column_rank = 0;
  }
  if (storage.precision == Precision::kF16) {
    streamed.values_f16 = stream_values(storage, streamed.blocks, storage.values_f16);
  } else {
    streamed.values_f32 = stream_values(storage, streamed.blocks, storage.values_f32);
  }
  return streamed;
}

Storage HierarchicalOperator::encode_half(const Storage& storage) {
  const Storage exact = stream_for_halves(storage);
  Storage half = exact;
  half.precision = Precision::kF16;
  half.values_f32 = {};
  drop_remainders(half);
  const HierarchicalLayout layout(half);
  std::vector<std::uint16_t> values(exact.values_f32.size());
  for (std::uint64_t k = 0; k < values.size(); ++k) {
    const float value = exact.values_f32[k];
    values[k] = k < layout.basis_value_count ? float_to_half(value) : encode_core_value(value);
  }
  half.values_f16 = SharedArray(std::move(values));
  return half;
}

Storage HierarchicalOperator::encode_shorts(const Storage& storage) {
  return encode_integers(stream_for_halves(storage), Precision::kQ16);
}

Storage HierarchicalOperator::encode_bytes(const Storage& storage) {
  return encode_integers(stream_for_halves(storage), Precision::kQ8);
}

Storage HierarchicalOperator::encode(const Storage& storage, Precision precision) {
  switch (precision) {
    case Precision::kF16:
      return encode_half(storage);
    case Precision::kQ16:
      return encode_shorts(storage);
    case Precision::kQ8:
      return encode_bytes(storage);
    case Precision::kF32:
      break;
  }
  return stream_exact(storage);
}

float product_scale(Precision precision) {
  constexpr float kHalfScale = HierarchicalOperator::kHalfScale;
  constexpr float kByteScale = HierarchicalOperator::kByteScale;
  constexpr float kShortScale = HierarchicalOperator::kShortScale;
  switch (precision) {
    case Precision::kF16:
      return 1 / kHalfScale;
    case Precision::kQ16:
      return 1 / (kHalfScale * kShortScale * kShortScale);
    case Precision::kQ8:
      return 1 / (kHalfScale * kByteScale * kByteScale);
    case Precision::kF32:
      break;
  }
  return 1;
}

}  // namespace rebounce
