#include "rebounce/transfer/hierarchical_operator.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "block_kernels.h"
#include "half_float.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

constexpr std::size_t kAlignment = HierarchicalOperator::kAlignment;

// Blocks are shared out among this many sums whatever the number of threads, so that the order of
// additions, and with it every bit, is always the same. More would cost a small operator more than
// they gain a large one.
constexpr std::size_t kSlotCount = 8;

// More values than any memory holds: sums of block sizes stay far from the end of 64 bits.
constexpr std::uint64_t kMostValues = std::uint64_t{1} << 48;

std::size_t round_up(std::size_t size) {
  return (size + kAlignment - 1) / kAlignment * kAlignment;
}

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

/// Writes each block's offset; returns the number of values of all of them.
std::uint64_t place_blocks(std::vector<TransferBlock>& blocks, std::uint32_t matrix_count) {
  std::uint64_t offset = 0;
  for (TransferBlock& block : blocks) {
    block.offset = offset;
    offset += block.value_count(matrix_count);
    if (offset > kMostValues) refuse("its blocks are larger than any memory");
  }
  return offset;
}

/// Where the parts of a block's values begin.
template <typename Value>
struct LowRankValues {
  const Value *row_basis, *column_basis, *cores;

  LowRankValues(const TransferBlock& block, const Value* values) : row_basis(values) {
    const std::size_t row_size = std::size_t{block.row_rank} * block.row_count;
    column_basis = block.on_diagonal() ? row_basis : row_basis + row_size;
    cores = column_basis + std::size_t{block.column_rank} * block.column_count;
  }
};

/// Coefficients of the three channels in the bases of one block, [3][rank stride] each.
struct Coefficients {
  float *row_in, *column_in, *row_out, *column_out;
  std::size_t stride;

  Coefficients(float* buffer, std::size_t rank_stride) : stride(rank_stride) {
    const std::size_t size = kChannelCount * stride;
    row_in = buffer;
    column_in = row_in + size;
    row_out = column_in + size;
    column_out = row_out + size;
  }
};

/// The three planar vectors x are multiplied and the products added to y, both [3][stride].
template <typename Value>
class BlockProduct {
 public:
  BlockProduct(const BlockKernels<Value>& kernels, const HierarchicalOperator::Storage& storage,
               const Value* values, const float* x, float* y, const Coefficients& coefficients)
      : kernels_(kernels),
        storage_(storage),
        values_(values),
        x_(x),
        y_(y),
        stride_(HierarchicalOperator::position_count(storage.area.size())),
        coefficients_(coefficients) {}

  void add(const TransferBlock& block) const {
    if (block.kind == TransferBlock::Kind::kDense) {
      add_dense(block);
    } else if (block.row_rank > 0 && block.column_rank > 0) {
      add_low_rank(block);
    }
  }

 private:
  void add_dense(const TransferBlock& block) const {
    const std::size_t size = std::size_t{block.row_count} * block.column_count;
    for (int c = 0; c < kChannelCount; ++c) {
      const Value* values = values_ + block.offset + storage_.channel_matrix[c] * size;
      const float* x = x_ + c * stride_;
      float* y = y_ + c * stride_;
      if (block.on_diagonal()) {
        kernels_.dense_diagonal(values, block.row_count, x + block.column_begin,
                                y + block.row_begin);
      } else {
        kernels_.dense(values, block.row_count, block.column_count, x + block.column_begin,
                       x + block.row_begin, y + block.row_begin, y + block.column_begin);
      }
    }
  }

  void add_low_rank(const TransferBlock& block) const {
    const LowRankValues<Value> values(block, values_ + block.offset);
    const std::size_t rows = block.row_rank, columns = block.column_rank;
    const Coefficients& k = coefficients_;
    kernels_.project(values.row_basis, rows, block.row_count, x_ + block.row_begin, stride_,
                     k.row_in, k.stride);
    kernels_.project(values.column_basis, columns, block.column_count, x_ + block.column_begin,
                     stride_, k.column_in, k.stride);
    for (int c = 0; c < kChannelCount; ++c) {
      const std::size_t at = c * k.stride;
      std::fill(k.column_in + at + columns, k.column_in + at + round_up(columns), 0.0F);
      kernels_.core(values.cores + storage_.channel_matrix[c] * rows * columns, rows, columns,
                    k.column_in + at, k.row_in + at, k.row_out + at, k.column_out + at);
    }
    kernels_.expand(values.row_basis, rows, block.row_count, k.row_out, k.stride,
                    y_ + block.row_begin, stride_);
    if (block.on_diagonal()) return;
    kernels_.expand(values.column_basis, columns, block.column_count, k.column_out, k.stride,
                    y_ + block.column_begin, stride_);
  }

  const BlockKernels<Value>& kernels_;
  const HierarchicalOperator::Storage& storage_;
  const Value* values_;
  const float* x_;
  float* y_;
  std::size_t stride_;
  const Coefficients& coefficients_;
};

/// Reads values of either precision as what they stand for.
class ValueReader {
 public:
  explicit ValueReader(const HierarchicalOperator::Storage& storage) : storage_(storage) {}

  double basis(std::uint64_t index) const {
    return storage_.precision == Precision::kF16 ? half_to_float(storage_.values_f16[index])
                                                 : storage_.values_f32[index];
  }
  double scaled(std::uint64_t index) const {
    const double value = basis(index);
    return storage_.precision == Precision::kF16 ? value / HierarchicalOperator::kHalfScale : value;
  }

 private:
  const HierarchicalOperator::Storage& storage_;
};

/// The entries of one block, [row_count][column_count], of one matrix.
std::vector<double> block_entries(const HierarchicalOperator::Storage& storage,
                                  const TransferBlock& block, std::uint32_t matrix) {
  const ValueReader read(storage);
  const std::size_t rows = block.row_count, columns = block.column_count;
  std::vector<double> entries(rows * columns, 0.0);
  if (block.kind == TransferBlock::Kind::kDense) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      entries[k] = read.scaled(block.offset + matrix * entries.size() + k);
    }
    return entries;
  }
  const std::size_t row_rank = block.row_rank, column_rank = block.column_rank;
  const std::uint64_t u = block.offset;
  const std::uint64_t v = block.on_diagonal() ? u : u + row_rank * rows;
  const std::uint64_t s = v + column_rank * columns + matrix * row_rank * column_rank;
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

}  // namespace

std::uint64_t TransferBlock::value_count(std::uint32_t matrix_count) const {
  const std::uint64_t rows = row_count, columns = column_count;
  if (kind == Kind::kDense) return matrix_count * rows * columns;
  const std::uint64_t column_basis = on_diagonal() ? 0 : columns * column_rank;
  return rows * row_rank + column_basis +
         std::uint64_t{matrix_count} * row_rank * std::uint64_t{column_rank};
}

std::size_t HierarchicalOperator::position_count(std::size_t patch_count) {
  return round_up(patch_count);
}

HierarchicalOperator::Storage HierarchicalOperator::encode_half(const Storage& storage) {
  Storage half = storage;
  half.precision = Precision::kF16;
  half.values_f32 = {};
  std::vector<std::uint16_t> values(storage.values_f32.size());
  const auto encode = [&](std::uint64_t begin, std::uint64_t end, float scale) {
    for (std::uint64_t k = begin; k < end; ++k) {
      values[k] = float_to_half(storage.values_f32[k] * scale);
      if ((values[k] & 0x7FFFU) >= 0x7C00U) {
        throw Error("an entry of the operator is too large for f16; use --precision f32");
      }
    }
  };
  place_blocks(half.blocks, half.matrix_count);
  for (const TransferBlock& block : half.blocks) {
    const std::uint64_t end = block.offset + block.value_count(half.matrix_count);
    std::uint64_t scaled = block.offset;
    if (block.kind == TransferBlock::Kind::kLowRank) {
      scaled = end - std::uint64_t{half.matrix_count} * block.row_rank * block.column_rank;
    }
    encode(block.offset, scaled, 1.0F);
    encode(scaled, end, kHalfScale);
  }
  half.values_f16 = SharedArray(std::move(values));
  return half;
}

HierarchicalOperator::HierarchicalOperator(Storage storage) : storage_(std::move(storage)) {
  const std::size_t n = patch_count(), positions = position_count(n);
  if (n == 0) refuse("there are no patches");
  if (storage_.matrix_count < 1 || storage_.matrix_count > kChannelCount) {
    refuse("not 1, 2 or 3 matrices");
  }
  for (const std::uint32_t matrix : storage_.channel_matrix) {
    if (matrix >= storage_.matrix_count) refuse("a channel has no matrix");
  }
  check_permutation(storage_.patch, n);
  std::uint32_t largest_rank = 0;
  for (const TransferBlock& block : storage_.blocks) {
    check_block(block, positions);
    largest_rank = std::max({largest_rank, block.row_rank, block.column_rank});
  }
  rank_stride_ = round_up(largest_rank);
  const std::uint64_t used = place_blocks(storage_.blocks, storage_.matrix_count);
  const bool half = storage_.precision == Precision::kF16;
  if ((half ? storage_.values_f16.size() : storage_.values_f32.size()) != used + kPadding) {
    refuse("the number of values does not fit the blocks");
  }
  sqrt_area_.reserve(n);
  for (const std::uint32_t p : storage_.patch) sqrt_area_.push_back(std::sqrt(storage_.area[p]));
  slots_ = share_out(storage_.blocks, used);
}

std::vector<HierarchicalOperator::Slot> HierarchicalOperator::share_out(
    std::span<const TransferBlock> blocks, std::uint64_t value_count) {
  std::vector<Slot> slots(kSlotCount);
  std::size_t next = 0;
  for (std::size_t s = 0; s < kSlotCount; ++s) {
    Slot& slot = slots[s];
    slot = {next, next, std::numeric_limits<std::size_t>::max(), 0};
    const std::uint64_t end = value_count * (s + 1) / kSlotCount;
    for (; next < blocks.size() && (s + 1 == kSlotCount || blocks[next].offset < end); ++next) {
      const TransferBlock& block = blocks[next];
      slot.begin = std::min<std::size_t>({slot.begin, block.row_begin, block.column_begin});
      slot.end = std::max<std::size_t>({slot.end, std::size_t{block.row_begin} + block.row_count,
                                        std::size_t{block.column_begin} + block.column_count});
    }
    slot.last_block = next;
    slot.begin = std::min(slot.begin, slot.end);
  }
  return slots;
}

std::size_t HierarchicalOperator::bytes() const {
  // On disk and in memory a block is described by seven numbers of 32 bits and its offset.
  return storage_.values_f16.size_bytes() + storage_.values_f32.size_bytes() +
         storage_.blocks.size() * sizeof(TransferBlock) +
         storage_.patch.size() * sizeof(std::uint32_t);
}

std::size_t HierarchicalOperator::slot_size() const {
  return kChannelCount * (position_count(patch_count()) + 4 * rank_stride_);
}

std::size_t HierarchicalOperator::workspace_size() const {
  return kChannelCount * position_count(patch_count()) + kSlotCount * slot_size();
}

template <typename Value>
void HierarchicalOperator::apply_slots(const BlockKernels<Value>& kernels, const Value* values,
                                       const float* x, float* slots) const {
  const std::size_t stride = position_count(patch_count());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t s = 0; s < kSlotCount; ++s) {
    const Slot& slot = slots_[s];
    float* y = slots + s * slot_size();
    for (int c = 0; c < kChannelCount; ++c) {
      std::fill(y + c * stride + slot.begin, y + c * stride + slot.end, 0.0F);
    }
    const Coefficients coefficients(y + kChannelCount * stride, rank_stride_);
    const BlockProduct<Value> product(kernels, storage_, values, x, y, coefficients);
    for (std::size_t b = slot.first_block; b < slot.last_block; ++b)
      product.add(storage_.blocks[b]);
  }
}

void HierarchicalOperator::apply(std::span<const Float3> initial_exitance,
                                 std::span<Float3> indirect_irradiance,
                                 std::span<float> workspace) const {
  const std::size_t n = patch_count(), stride = position_count(n);
  assert(initial_exitance.size() == n && indirect_irradiance.size() == n);
  assert(workspace.size() >= workspace_size());

  float* x = workspace.data();
  float* slots = x + kChannelCount * stride;
  for (int c = 0; c < kChannelCount; ++c) std::fill(x + c * stride + n, x + (c + 1) * stride, 0.0F);
  for (std::size_t k = 0; k < n; ++k) {
    const Float3& light = initial_exitance[storage_.patch[k]];
    for (int c = 0; c < kChannelCount; ++c) x[c * stride + k] = sqrt_area_[k] * light[c];
  }

  const bool half = storage_.precision == Precision::kF16;
  if (half) {
    apply_slots(block_kernels().f16, storage_.values_f16.data(), x, slots);
  } else {
    apply_slots(block_kernels().f32, storage_.values_f32.data(), x, slots);
  }

  const float scale = half ? 1.0F / kHalfScale : 1.0F;
  for (int c = 0; c < kChannelCount; ++c) {
    float* const sum = x + c * stride;  // x has done its work
    add_slots(c, slots, sum);
    for (std::size_t k = 0; k < n; ++k) {
      indirect_irradiance[storage_.patch[k]][c] = sum[k] * scale / sqrt_area_[k];
    }
  }
}

void HierarchicalOperator::add_slots(int channel, const float* slots, float* sum) const {
  const std::size_t stride = position_count(patch_count());
  std::fill_n(sum, stride, 0.0F);
  for (std::size_t s = 0; s < kSlotCount; ++s) {
    const float* y = slots + s * slot_size() + channel * stride;
    for (std::size_t k = slots_[s].begin; k < slots_[s].end; ++k) sum[k] += y[k];
  }
}

void HierarchicalOperator::expand(int channel, std::span<float> transfer) const {
  const std::size_t n = patch_count();
  assert(transfer.size() == n * n);
  std::ranges::fill(transfer, 0.0F);
  const auto put = [&](std::size_t i, std::size_t j, double value) {
    const std::size_t row = storage_.patch[i], column = storage_.patch[j];
    transfer[row * n + column] = static_cast<float>(value * sqrt_area_[j] / sqrt_area_[i]);
  };
  for (const TransferBlock& block : storage_.blocks) {
    const std::vector<double> entries =
        block_entries(storage_, block, storage_.channel_matrix[channel]);
    for (std::size_t r = 0; r < block.row_count; ++r) {
      for (std::size_t c = 0; c < block.column_count; ++c) {
        const std::size_t i = block.row_begin + r, j = block.column_begin + c;
        if (i >= n || j >= n) continue;
        put(i, j, entries[r * block.column_count + c]);
        if (!block.on_diagonal()) put(j, i, entries[r * block.column_count + c]);
      }
    }
  }
}

}  // namespace rebounce
