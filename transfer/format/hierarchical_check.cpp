#include "transfer/format/hierarchical_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "rebounce/error.h"
#include "transfer/base/finite_values.h"
#include "transfer/data/patch_roles.h"
#include "transfer/format/hierarchical_layout.h"

namespace rebounce {
namespace {

using Storage = HierarchicalStorage;

constexpr std::size_t kAlignment = HierarchicalFormat::kAlignment;

[[noreturn]] void refuse(const std::string& reason) {
  throw Error("hierarchical operator: " + reason);
}

void check_permutation(std::span<const std::uint32_t> patch, std::size_t patch_count) {
  if (patch.size() != patch_count) refuse("there is not one position for each patch");
  std::vector<bool> seen(patch_count, false);
  for (const std::uint32_t p : patch) {
    if (p >= patch_count || seen[p]) refuse("the order of patches is not a permutation");
    seen[p] = true;
  }
}

void check_exponents(std::span<const std::int8_t> exponents, std::size_t patch_count) {
  if (!exponents.empty() && exponents.size() != patch_count) {
    refuse("there is not one scale for each position");
  }
  constexpr int kLargest = HierarchicalFormat::kLargestExponent;
  if (std::ranges::any_of(exponents, [](int e) { return e < -kLargest || e > kLargest; })) {
    refuse("a scale of a position is beyond 2^+-" + std::to_string(kLargest));
  }
}

/// The index ranges of an operator: the positions of patches with their padding, then the cluster
/// coefficients.
struct IndexRanges {
  std::size_t position_count, cluster_coefficient_count;
  /// [cluster_coefficient_count + 1] whether a cluster basis begins there; true at the end.
  std::vector<bool> is_border;

  /// Whether [begin, begin + count) is an aligned, non-empty range of positions.
  bool are_positions(std::uint64_t begin, std::uint64_t count) const {
    return are_aligned(begin, count) && begin + count <= position_count;
  }
  bool are_cluster_coefficients(std::uint64_t begin, std::uint64_t count) const {
    return are_aligned(begin, count) && begin >= position_count &&
           begin + count <= position_count + cluster_coefficient_count;
  }
  /// Whether a range of positions or of cluster coefficients cuts no cluster basis.
  bool cuts_no_basis(std::uint64_t begin, std::uint64_t count) const {
    return begin < position_count ||
           (is_border[begin - position_count] && is_border[begin + count - position_count]);
  }

 private:
  static bool are_aligned(std::uint64_t begin, std::uint64_t count) {
    return count > 0 && begin % kAlignment == 0 && count % kAlignment == 0;
  }
};

void check_cluster_basis(const TransferBlock& block, const IndexRanges& ranges) {
  if (!ranges.are_positions(block.row_begin, block.row_count))
    refuse("a cluster basis is not over positions");
  if (block.row_rank != block.column_count || block.row_rank > block.row_count ||
      block.column_rank != 0 || block.row_residual_rank > block.row_rank ||
      block.column_residual_rank != 0) {
    refuse("the rank of a cluster basis does not fit its size");
  }
}

void check_block(const TransferBlock& block, const IndexRanges& ranges) {
  if (is_cluster_basis(block)) return check_cluster_basis(block, ranges);
  const auto is_range = [&](std::uint32_t begin, std::uint32_t count) {
    return ranges.are_positions(begin, count) || (block.kind == TransferBlock::Kind::kLowRank &&
                                                  ranges.are_cluster_coefficients(begin, count));
  };
  if (!is_range(block.row_begin, block.row_count) ||
      !is_range(block.column_begin, block.column_count)) {
    refuse("a block is empty, not aligned or reaches outside the matrix");
  }
  if (!ranges.cuts_no_basis(block.row_begin, block.row_count) ||
      !ranges.cuts_no_basis(block.column_begin, block.column_count)) {
    refuse("a block begins or ends within the coefficients of a cluster basis");
  }
  const bool misplaced = block.on_diagonal()
                             ? block.row_count != block.column_count
                             : block.column_begin + block.column_count > block.row_begin;
  if (misplaced) refuse("a block is neither on the diagonal nor below it");
  switch (block.kind) {
    case TransferBlock::Kind::kDense:
      if ((block.row_rank | block.column_rank | block.row_residual_rank |
           block.column_residual_rank) != 0) {
        refuse("a dense block has a rank");
      }
      return;
    case TransferBlock::Kind::kLowRank:
      if (block.row_rank > block.row_count || block.column_rank > block.column_count ||
          (block.on_diagonal() && block.row_rank != block.column_rank)) {
        refuse("the ranks of a block do not fit its size");
      }
      if (block.row_residual_rank > block.row_rank ||
          block.column_residual_rank > block.column_rank ||
          (block.on_diagonal() && block.row_residual_rank != block.column_residual_rank)) {
        refuse("the residual ranks of a block do not fit its ranks");
      }
      return;
    case TransferBlock::Kind::kClusterBasis:
      return;
  }
  refuse("a block is of an unknown kind");
}

/// Returns the number of cluster coefficients. Checks that they are numbered in the order of their
/// blocks and that each has a finite scale.
std::size_t checked_cluster_coefficient_count(const Storage& storage, std::size_t position_count) {
  std::uint64_t end = position_count;
  for (const TransferBlock& block : storage.blocks) {
    if (!is_cluster_basis(block)) continue;
    if (block.column_begin != end)
      refuse("cluster coefficients are not numbered in the order of their blocks");
    end += block.column_count;
  }
  if ((end - position_count) % HierarchicalFormat::kAlignment != 0) {
    refuse("the number of cluster coefficients is no multiple of 16");
  }
  if (storage.coefficient_scale.size() != end - position_count)
    refuse("there is not one scale for each cluster coefficient");
  if (!std::ranges::all_of(storage.coefficient_scale, [](float s) { return std::isfinite(s); })) {
    refuse("a scale of a cluster coefficient is not finite");
  }
  return end - position_count;
}

/// IndexRanges::is_border.
std::vector<bool> borders_of_cluster_bases(const Storage& storage, std::size_t position_count,
                                           std::size_t coefficient_count) {
  std::vector<bool> is_border(coefficient_count + 1, false);
  is_border.back() = true;
  for (const TransferBlock& block : storage.blocks) {
    if (is_cluster_basis(block)) is_border[block.column_begin - position_count] = true;
  }
  return is_border;
}

void check_tables(const Storage& storage) {
  const std::size_t n = storage.area.size();
  if (n == 0) refuse("there are no patches");
  if (storage.matrix_count < 1 || storage.matrix_count > kChannelCount) {
    refuse("the number of matrices is not 1, 2 or 3");
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
  const std::size_t positions = HierarchicalFormat::position_count(n);
  const std::size_t coefficients = checked_cluster_coefficient_count(storage, positions);
  const IndexRanges ranges{positions, coefficients,
                           borders_of_cluster_bases(storage, positions, coefficients)};
  for (const TransferBlock& block : storage.blocks) {
    check_block(block, ranges);
    const bool one_rank =
        !is_cluster_basis(block) && (block.row_rank == 0) != (block.column_rank == 0);
    if (one_rank && storage.order == HierarchicalStorage::Order::kStreamed) {
      refuse("a block has only one rank");
    }
    if (storage.precision.bases == BasisPrecision::kF16 &&
        (block.row_residual_rank | block.column_residual_rank) != 0) {
      refuse("a block has residual ranks, but its bases are not in 8 bits");
    }
  }
}

std::uint64_t block_order_count(const Storage& storage) {
  std::uint64_t count = HierarchicalFormat::kPadding;
  for (const TransferBlock& block : storage.blocks)
    count += block.value_count(storage.matrix_count);
  return count;
}

/// Whether each array has exactly the number of values that the blocks need.
bool sizes_fit(const Storage& storage) {
  const HierarchicalLayout layout(storage);
  const std::uint64_t bases = layout.basis_value_count, couplings = layout.coupling_value_count;
  std::map<const void*, std::uint64_t> expected;
  const auto expect = [&](std::uint64_t count) {
    return [&expected, count](const auto& array) { expected[&array] = count; };
  };
  if (storage.one_array()) {
    with_bases(storage, expect(storage.order == HierarchicalStorage::Order::kStreamed
                                   ? HierarchicalLayout::padded(bases + couplings)
                                   : block_order_count(storage)));
  } else {
    with_bases(storage, expect(HierarchicalLayout::padded(bases)));
    with_couplings(storage, expect(HierarchicalLayout::padded(couplings)));
  }
  if (storage.has_packed_couplings()) {
    expect(HierarchicalLayout::padded_packed(layout.packed_bytes))(storage.packed_couplings);
  }
  bool fit = true;
  for_each_array(storage, [&](const auto& array) { fit &= array.size() == expected[&array]; });
  return fit;
}

}  // namespace

void check_hierarchical_storage(const Storage& storage) {
  check_tables(storage);
  if (!is_offered(storage.precision)) refuse("its precisions cannot be combined");
  if (!storage.one_array() && storage.order != HierarchicalStorage::Order::kStreamed) {
    refuse("bases in integers are not in the streamed order");
  }
  if (!sizes_fit(storage)) refuse("the number of values does not fit the blocks");
  if (!are_finite(storage.values_f32.span()) || !halves_are_finite(storage.values_f16.span())) {
    refuse("a value is not finite");
  }
}

}  // namespace rebounce
