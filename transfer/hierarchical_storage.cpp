#include "hierarchical_storage.h"

#include <algorithm>

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
                 const Value* from, std::uint64_t count, std::vector<Value>& values) {
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
  copy(static_cast<std::uint64_t>(end - from), place.values);
}

template <typename Value>
SharedArray<Value> stream_values(const Storage& storage, const std::vector<TransferBlock>& blocks,
                                 const SharedArray<Value>& values) {
  const HierarchicalLayout layout(blocks, storage.matrix_count);
  std::vector<Value> streamed(layout.padded_count());
  const Value* from = values.data();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (has_values(blocks[b])) {
      place_block(blocks[b], layout.places[b], from, blocks[b].value_count(storage.matrix_count),
                  streamed);
    }
    from += storage.blocks[b].value_count(storage.matrix_count);
  }
  return SharedArray(std::move(streamed));
}

/// Reads values of either precision as what they stand for.
class ValueReader {
 public:
  explicit ValueReader(const Storage& storage) : storage_(storage) {}

  double basis(std::uint64_t index) const {
    return storage_.precision == Precision::kF16 ? half_to_float(storage_.values_f16[index])
                                                 : storage_.values_f32[index];
  }
  double scaled(std::uint64_t index) const {
    const double value = basis(index);
    return storage_.precision == Precision::kF16 ? value / HierarchicalOperator::kHalfScale : value;
  }

 private:
  const Storage& storage_;
};

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
  const HierarchicalLayout layout(storage.blocks, storage.matrix_count);
  const std::uint64_t expected = storage.order == HierarchicalOperator::Order::kStreamed
                                     ? layout.padded_count()
                                     : block_order_count(storage);
  const bool half = storage.precision == Precision::kF16;
  if ((half ? storage.values_f16.size() : storage.values_f32.size()) != expected) {
    refuse("the number of values does not fit the blocks");
  }
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
    values[k] = float_to_half(k < layout.basis_value_count ? exact[k] : exact[k] * kHalfScale);
    if ((values[k] & 0x7FFFU) >= 0x7C00U) {
      throw Error("an entry of the operator is too large for f16; use --precision f32");
    }
  }
  half.values_f16 = SharedArray(std::move(values));
  return half;
}

std::vector<double> block_entries(const Storage& storage, const HierarchicalLayout& layout,
                                  std::size_t index, std::uint32_t matrix) {
  const ValueReader read(storage);
  const TransferBlock& block = storage.blocks[index];
  const HierarchicalLayout::Place& place = layout.places[index];
  const std::size_t rows = block.row_count, columns = block.column_count;
  std::vector<double> entries(rows * columns, 0.0);
  if (block.kind == TransferBlock::Kind::kDense) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      entries[k] = read.scaled(place.values + matrix * entries.size() + k);
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
      const double core = read.scaled(s + r * column_rank + k);
      for (std::size_t j = 0; j < columns; ++j) right[j] += core * read.basis(v + k * columns + j);
    }
    for (std::size_t i = 0; i < rows; ++i) {
      const double left = read.basis(u + r * rows + i);
      for (std::size_t j = 0; j < columns; ++j) entries[i * columns + j] += left * right[j];
    }
  }
  return entries;
}

}  // namespace rebounce
