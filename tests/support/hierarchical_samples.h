#pragma once

// Hierarchical operators with random values, for tests that need no scene.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test {

/// Blocks of all kinds over `patch_count` patches in a random order; f32. Nested, they have cluster
/// coefficients where they can: of each 64 positions sixteen, in two cells.
class RandomHierarchicalStorage {
 public:
  RandomHierarchicalStorage(std::size_t patch_count, std::uint32_t matrix_count, std::uint64_t seed,
                            bool nested)
      : engine_(seed),
        positions_(static_cast<std::uint32_t>(HierarchicalFormat::position_count(patch_count))),
        nested_(nested) {
    storage.matrix_count = matrix_count;
    storage.channel_matrix = {0, matrix_count > 1 ? 1U : 0U, matrix_count - 1};
    for (std::size_t i = 0; i < patch_count; ++i) storage.area.push_back(0.1F + uniform());
    storage.patch.resize(patch_count);
    std::iota(storage.patch.begin(), storage.patch.end(), 0U);
    std::shuffle(storage.patch.begin(), storage.patch.end(), engine_);
    if (nested_) add_coefficients();
    add_diagonal(0, positions_);
    values_.resize(values_.size() + HierarchicalFormat::kPadding, 0.0F);
    storage.values_f32 = SharedArray(std::move(values_));
  }

  HierarchicalStorage storage;

 private:
  static constexpr std::uint32_t kLeaf = 32, kAlignment = HierarchicalFormat::kAlignment;

  float uniform() { return std::uniform_real_distribution<float>(0, 1)(engine_); }

  static std::uint32_t half(std::uint32_t count) {
    return (count / 2 + kAlignment - 1) / kAlignment * kAlignment;
  }

  void add_coefficients() {
    std::uint32_t coefficient = positions_;
    for (std::uint32_t begin = 0; begin + kNested <= positions_; begin += kNested) {
      for (const std::uint32_t rank : {5U, 11U}) {
        storage.blocks.push_back({.row_begin = begin + (rank == 5 ? 0 : kNested / 2),
                                  .row_count = kNested / 2,
                                  .column_begin = coefficient,
                                  .column_count = rank,
                                  .kind = TransferBlock::Kind::kClusterBasis,
                                  .row_rank = rank,
                                  .row_residual_rank = rank / 3});
        coefficient += rank;
        for (std::uint32_t k = 0; k < rank; ++k) storage.coefficient_scale.push_back(2 + uniform());
        for (std::uint32_t k = 0; k < rank * kNested / 2; ++k) values_.push_back(scaled());
      }
    }
  }

  float scaled() { return uniform() / std::sqrt(static_cast<float>(storage.area.size())); }

  /// Positions become their cluster coefficients, sometimes.
  void nest(std::uint32_t& begin, std::uint32_t& count) {
    if (!nested_ || begin % kNested != 0 || count % kNested != 0 || uniform() < 0.3F) return;
    begin = positions_ + begin / 4;
    count /= 4;
  }

  void nest(TransferBlock& block) {
    const bool diagonal = block.on_diagonal();
    nest(block.row_begin, block.row_count);
    if (diagonal) {
      block.column_begin = block.row_begin;
      block.column_count = block.row_count;
      return;
    }
    nest(block.column_begin, block.column_count);
    if (block.column_begin > block.row_begin) {
      std::swap(block.column_begin, block.row_begin);
      std::swap(block.column_count, block.row_count);
    }
  }

  void add_diagonal(std::uint32_t begin, std::uint32_t count) {
    if (count <= kLeaf || uniform() < 0.1F) return add(begin, count, begin, count);
    const std::uint32_t first = half(count);
    add_diagonal(begin, first);
    add_below(begin + first, count - first, begin, first);
    add_diagonal(begin + first, count - first);
  }

  void add_below(std::uint32_t row, std::uint32_t rows, std::uint32_t column,
                 std::uint32_t columns) {
    if (rows <= kLeaf || columns <= kLeaf || uniform() < 0.2F) {
      return add(row, rows, column, columns);
    }
    for (const std::uint32_t r : {0U, half(rows)}) {
      for (const std::uint32_t c : {0U, half(columns)}) {
        add_below(row + r, r == 0 ? half(rows) : rows - half(rows), column + c,
                  c == 0 ? half(columns) : columns - half(columns));
      }
    }
  }

  void add(std::uint32_t row, std::uint32_t rows, std::uint32_t column, std::uint32_t columns) {
    TransferBlock block{
        .row_begin = row, .row_count = rows, .column_begin = column, .column_count = columns};
    if (uniform() < 0.6F) {
      block.kind = TransferBlock::Kind::kLowRank;
      nest(block);
      block.row_rank = random_rank(block.row_count);
      block.column_rank = block.on_diagonal() ? block.row_rank : random_rank(block.column_count);
      if (block.column_rank == 0) block.row_rank = 0;
      if (block.row_rank == 0) block.column_rank = 0;
      block.row_residual_rank = block.row_rank / 3;
      block.column_residual_rank =
          block.on_diagonal() ? block.row_residual_rank : block.column_rank / 4;
    }
    storage.blocks.push_back(block);
    const std::size_t begin = values_.size();
    const std::uint64_t count = block.value_count(storage.matrix_count);
    for (std::uint64_t k = 0; k < count; ++k) values_.push_back(scaled());
    make_symmetric(block, begin);
  }

  std::uint32_t random_rank(std::uint32_t size) {
    return std::min(size, static_cast<std::uint32_t>(engine_() % 20));
  }

  /// Of a block on the diagonal: the entries or the coupling matrices, which end it.
  void make_symmetric(const TransferBlock& block, std::size_t begin) {
    if (!block.on_diagonal()) return;
    const bool dense = block.kind == TransferBlock::Kind::kDense;
    const std::size_t size = dense ? block.row_count : block.row_rank;
    for (std::uint32_t m = 0; m < storage.matrix_count; ++m) {
      float* entries =
          values_.data() + begin + block.value_count(storage.matrix_count) - (m + 1) * size * size;
      for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t j = 0; j < i; ++j) entries[j * size + i] = entries[i * size + j];
      }
    }
  }

  static constexpr std::uint32_t kNested = 64;

  std::mt19937_64 engine_;
  std::uint32_t positions_;
  bool nested_;
  std::vector<float> values_;
};

inline HierarchicalStorage random_hierarchical_storage(std::size_t patch_count,
                                                       std::uint32_t matrix_count,
                                                       std::uint64_t seed) {
  return RandomHierarchicalStorage(patch_count, matrix_count, seed, false).storage;
}

/// With cluster coefficients for the positions of some blocks.
inline HierarchicalStorage random_nested_storage(std::size_t patch_count,
                                                 std::uint32_t matrix_count, std::uint64_t seed) {
  return RandomHierarchicalStorage(patch_count, matrix_count, seed, true).storage;
}

/// The same with scales of positions from 1/64 to 4.
inline HierarchicalStorage equilibrated(HierarchicalStorage storage, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_int_distribution<int> exponent(-6, 2);
  for (std::size_t k = 0; k < storage.area.size(); ++k) {
    storage.scale_exponent.push_back(static_cast<std::int8_t>(exponent(engine)));
  }
  return storage;
}

/// The same with roles by position: the first third both, then receivers, sources, and patches with
/// no role.
inline HierarchicalStorage with_roles(HierarchicalStorage storage) {
  storage.roles.role.resize(storage.patch.size());
  for (std::size_t k = 0; k < storage.patch.size(); ++k) {
    const std::size_t sixth = 6 * k / storage.patch.size();
    storage.roles.role[storage.patch[k]] = sixth < 2    ? PatchRoles::kBoth
                                           : sixth == 2 ? PatchRoles::kReceiver
                                           : sixth < 5  ? PatchRoles::kSource
                                                        : std::uint8_t{0};
  }
  return storage;
}

}  // namespace rebounce::test
