#include "hierarchical_storage.h"

#include <algorithm>
#include <cmath>

#include "half_float.h"
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

/// Whether [begin, begin + count) is a cluster's range of positions.
bool is_range(std::uint64_t begin, std::uint64_t count, std::size_t position_count) {
  return count > 0 && begin % kAlignment == 0 && count % kAlignment == 0 &&
         begin + count <= position_count;
}

void check_block(const TransferBlock& block, std::size_t position_count) {
  if (!is_range(block.row_begin, block.row_count, position_count) ||
      !is_range(block.column_begin, block.column_count, position_count)) {
    refuse("a block is empty, not aligned or reaches outside the matrix");
  }
  const bool misplaced = block.on_diagonal()
                             ? block.row_count != block.column_count
                             : block.column_begin + block.column_count > block.row_begin;
  if (misplaced) refuse("a block is neither on the diagonal nor below it");
  switch (block.kind) {
    case TransferBlock::Kind::kDense:
      if (block.row_rank != 0 || block.column_rank != 0) refuse("a dense block has a rank");
      return;
    case TransferBlock::Kind::kLowRank:
      if (block.row_rank > block.row_count || block.column_rank > block.column_count ||
          (block.on_diagonal() && block.row_rank != block.column_rank)) {
        refuse("the ranks of a block do not fit its size");
      }
      return;
  }
  refuse("a block is of an unknown kind");
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
  for (const TransferBlock& block : storage.blocks) {
    check_block(block, HierarchicalOperator::position_count(n));
    const bool one_rank = (block.row_rank == 0) != (block.column_rank == 0);
    if (one_rank && storage.order == HierarchicalOperator::Order::kStreamed) {
      refuse("a block has only one rank");
    }
  }
}

std::uint64_t block_order_count(const Storage& storage) {
  std::uint64_t count = HierarchicalOperator::kPadding;
  for (const TransferBlock& block : storage.blocks)
    count += block.value_count(storage.matrix_count);
  return count;
}

/// Copies runs of values of one block from where it begins to where they belong.
template <typename Value>
void place_block(const TransferBlock& block, const HierarchicalLayout::Place& place,
                 std::uint64_t first_core, const Value* from, std::uint64_t count,
                 std::vector<Value>& values) {
  const Value* const end = from + count;
  const auto copy = [&](std::uint64_t size, std::uint64_t to) {
    std::copy_n(from, size, values.begin() + static_cast<std::ptrdiff_t>(to));
    from += size;
  };
  if (block.kind == TransferBlock::Kind::kLowRank) {
    copy(std::uint64_t{block.row_rank} * block.row_count, place.row.basis);
    if (!block.on_diagonal()) {
      copy(std::uint64_t{block.column_rank} * block.column_count, place.column.basis);
    }
  }
  copy(static_cast<std::uint64_t>(end - from), first_core + place.values);
}

template <typename Value>
SharedArray<Value> stream_values(const Storage& storage, const std::vector<TransferBlock>& blocks,
                                 const SharedArray<Value>& values) {
  const HierarchicalLayout layout(blocks, storage.matrix_count);
  std::vector<Value> streamed(
      HierarchicalLayout::padded(layout.basis_value_count + layout.core_value_count));
  const Value* from = values.data();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (has_values(blocks[b])) {
      place_block(blocks[b], layout.places[b], layout.basis_value_count, from,
                  blocks[b].value_count(storage.matrix_count), streamed);
    }
    from += storage.blocks[b].value_count(storage.matrix_count);
  }
  return SharedArray(std::move(streamed));
}

/// Reads values of any precision as what they stand for.
class ValueReader {
 public:
  ValueReader(const Storage& storage, const HierarchicalLayout& layout)
      : storage_(storage), first_core_(layout.basis_value_count) {}

  double basis(std::uint64_t index) const {
    switch (storage_.precision) {
      case Precision::kF16:
        return half_to_float(storage_.values_f16[index]);
      case Precision::kQ8:
        return storage_.bases_q8[index] / double{HierarchicalOperator::kByteScale};
      case Precision::kF32:
        break;
    }
    return storage_.values_f32[index];
  }
  /// Of a core or a dense entry.
  double core(std::uint64_t index) const {
    if (storage_.precision == Precision::kF32) return storage_.values_f32[first_core_ + index];
    const std::uint64_t first = storage_.precision == Precision::kF16 ? first_core_ : 0;
    return half_to_float(storage_.values_f16[first + index]) /
           double{HierarchicalOperator::kHalfScale};
  }

 private:
  const Storage& storage_;
  std::uint64_t first_core_;
};

/// Numbers of values that the arrays must have.
struct ArraySizes {
  std::uint64_t f32 = 0, f16 = 0, q8 = 0;
  bool operator==(const ArraySizes&) const = default;
};

ArraySizes expected_sizes(const Storage& storage) {
  const HierarchicalLayout layout(storage.blocks, storage.matrix_count);
  const std::uint64_t bases = layout.basis_value_count, cores = layout.core_value_count;
  if (storage.precision == Precision::kQ8) {
    return {.f16 = HierarchicalLayout::padded(cores), .q8 = HierarchicalLayout::padded(bases)};
  }
  const std::uint64_t all = storage.order == HierarchicalOperator::Order::kStreamed
                                ? HierarchicalLayout::padded(bases + cores)
                                : block_order_count(storage);
  if (storage.precision == Precision::kF16) return {.f16 = all};
  return {.f32 = all};
}

std::uint16_t encoded(float value) {
  const std::uint16_t half = float_to_half(value * HierarchicalOperator::kHalfScale);
  if ((half & 0x7FFFU) >= 0x7C00U) {
    throw Error("an entry of the operator is too large for f16; use --precision f32");
  }
  return half;
}

/// Rounds a basis [rank][size] to bytes; returns what each vector must be multiplied by, over
/// kByteScale.
std::vector<float> encode_basis(const float* basis, std::size_t rank, std::size_t size,
                                std::int8_t* bytes) {
  std::vector<float> scale(rank);
  for (std::size_t r = 0; r < rank; ++r, basis += size, bytes += size) {
    float largest = 0;
    for (std::size_t k = 0; k < size; ++k) largest = std::max(largest, std::abs(basis[k]));
    if (largest == 0) continue;
    for (std::size_t k = 0; k < size; ++k) {
      bytes[k] = static_cast<std::int8_t>(std::lround(basis[k] / largest * 127));
    }
    scale[r] = largest / 127 * HierarchicalOperator::kByteScale;
  }
  return scale;
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
  if (storage.precision == Precision::kQ8 &&
      storage.order != HierarchicalOperator::Order::kStreamed) {
    refuse("8 bits are for streamed values alone");
  }
  const ArraySizes sizes{storage.values_f32.size(), storage.values_f16.size(),
                         storage.bases_q8.size()};
  if (sizes != expected_sizes(storage)) refuse("the number of values does not fit the blocks");
}

Storage HierarchicalOperator::stream(const Storage& storage) {
  check_hierarchical_storage(storage);
  if (storage.order == Order::kStreamed) return storage;
  Storage streamed = storage;
  streamed.order = Order::kStreamed;
  for (TransferBlock& block : streamed.blocks) {
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
  Storage half = stream(storage);
  const SharedArray<float> exact = std::move(half.values_f32);
  half.precision = Precision::kF16;
  half.values_f32 = {};
  const HierarchicalLayout layout(half.blocks, half.matrix_count);
  std::vector<std::uint16_t> values(exact.size());
  for (std::uint64_t k = 0; k < values.size(); ++k) {
    values[k] = k < layout.basis_value_count ? float_to_half(exact[k]) : encoded(exact[k]);
  }
  half.values_f16 = SharedArray(std::move(values));
  return half;
}

Storage HierarchicalOperator::encode_bytes(const Storage& storage) {
  Storage bytes = stream(storage);
  const SharedArray<float> exact = std::move(bytes.values_f32);
  bytes.precision = Precision::kQ8;
  bytes.values_f32 = {};
  const HierarchicalLayout layout(bytes.blocks, bytes.matrix_count);
  std::vector<std::int8_t> bases(HierarchicalLayout::padded(layout.basis_value_count));
  std::vector<std::uint16_t> cores(HierarchicalLayout::padded(layout.core_value_count));
  const float* const core = exact.data() + layout.basis_value_count;
  for (std::size_t b = 0; b < bytes.blocks.size(); ++b) {
    const TransferBlock& block = bytes.blocks[b];
    const HierarchicalLayout::Place& place = layout.places[b];
    const auto encode_end = [&](const HierarchicalLayout::End& end, std::size_t rank,
                                std::size_t size) {
      return encode_basis(exact.data() + end.basis, rank, size, bases.data() + end.basis);
    };
    if (block.kind == TransferBlock::Kind::kDense) {
      const std::uint64_t count = block.value_count(bytes.matrix_count);
      std::transform(core + place.values, core + place.values + count, cores.data() + place.values,
                     encoded);
    } else if (has_values(block)) {
      const std::vector<float> rows = encode_end(place.row, block.row_rank, block.row_count);
      const std::vector<float> columns =
          encode_end(place.column, block.column_rank, block.column_count);
      std::uint64_t k = place.values;
      for (std::uint32_t matrix = 0; matrix < bytes.matrix_count; ++matrix) {
        for (const float row : rows) {
          for (const float column : columns) cores[k] = encoded(core[k] * row * column), ++k;
        }
      }
    }
  }
  bytes.bases_q8 = SharedArray(std::move(bases));
  bytes.values_f16 = SharedArray(std::move(cores));
  return bytes;
}

Storage HierarchicalOperator::encode(const Storage& storage, Precision precision) {
  switch (precision) {
    case Precision::kF16:
      return encode_half(storage);
    case Precision::kQ8:
      return encode_bytes(storage);
    case Precision::kF32:
      break;
  }
  return stream(storage);
}

std::vector<double> block_entries(const Storage& storage, const HierarchicalLayout& layout,
                                  std::size_t index, std::uint32_t matrix) {
  const ValueReader read(storage, layout);
  const TransferBlock& block = storage.blocks[index];
  const HierarchicalLayout::Place& place = layout.places[index];
  const std::size_t rows = block.row_count, columns = block.column_count;
  std::vector<double> entries(rows * columns, 0.0);
  if (block.kind == TransferBlock::Kind::kDense) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      entries[k] = read.core(place.values + matrix * entries.size() + k);
    }
    return entries;
  }
  const std::size_t row_rank = block.row_rank, column_rank = block.column_rank;
  const std::uint64_t u = place.row.basis, v = place.column.basis;
  const std::uint64_t s = place.values + matrix * row_rank * column_rank;
  std::vector<double> right(columns);  // a row of S V^T
  for (std::size_t r = 0; r < row_rank; ++r) {
    std::ranges::fill(right, 0.0);
    for (std::size_t k = 0; k < column_rank; ++k) {
      const double core = read.core(s + r * column_rank + k);
      for (std::size_t j = 0; j < columns; ++j) right[j] += core * read.basis(v + k * columns + j);
    }
    for (std::size_t i = 0; i < rows; ++i) {
      const double left = read.basis(u + r * rows + i);
      for (std::size_t j = 0; j < columns; ++j) entries[i * columns + j] += left * right[j];
    }
  }
  return entries;
}

float product_scale(Precision precision) {
  constexpr float kHalfScale = HierarchicalOperator::kHalfScale;
  constexpr float kByteScale = HierarchicalOperator::kByteScale;
  switch (precision) {
    case Precision::kF16:
      return 1 / kHalfScale;
    case Precision::kQ8:
      return 1 / (kHalfScale * kByteScale * kByteScale);
    case Precision::kF32:
      break;
  }
  return 1;
}

}  // namespace rebounce
