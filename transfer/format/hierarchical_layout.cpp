#include "transfer/format/hierarchical_layout.h"

#include <algorithm>
#include <limits>

#include "rebounce/error.h"
#include "transfer/format/channel_lanes.h"

namespace rebounce {
namespace {

constexpr std::uint64_t kStrip = HierarchicalFormat::kStrip;

// No memory holds more values. The limit keeps sums of block sizes far below 2^64.
constexpr std::uint64_t kMostValues = std::uint64_t{1} << 48;

using Cluster = HierarchicalLayout::Cluster;
using End = HierarchicalLayout::End;

bool comes_before(const Cluster& a, const Cluster& b) {
  return a.begin != b.begin ? a.begin < b.begin : a.size > b.size;
}

bool has_bases(const TransferBlock& block) {
  return block.kind != TransferBlock::Kind::kDense && has_values(block);
}

/// Calls visit(end, begin, size, rank, residual_rank) for each end of each block that has bases, in
/// the order of the blocks.
template <typename Visit>
void visit_ends(std::span<const TransferBlock> blocks,
                std::vector<HierarchicalLayout::BlockLayout>& block_layouts, const Visit& visit) {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const TransferBlock& block = blocks[b];
    if (!has_bases(block)) continue;
    visit(block_layouts[b].row, block.row_begin, block.row_count, block.row_rank,
          block.row_residual_rank);
    if (is_cluster_basis(block)) continue;
    if (block.on_diagonal()) {
      block_layouts[b].column = block_layouts[b].row;
    } else {
      visit(block_layouts[b].column, block.column_begin, block.column_count, block.column_rank,
            block.column_residual_rank);
    }
  }
}

std::uint32_t checked_count(std::uint64_t count) {
  if (count > std::numeric_limits<std::uint32_t>::max() / 2) {
    throw Error("hierarchical operator: its blocks have too many ranks");
  }
  return static_cast<std::uint32_t>(count);
}

}  // namespace

bool has_values(const TransferBlock& block) {
  return block.kind == TransferBlock::Kind::kDense || block.row_rank > 0;
}

HierarchicalLayout::HierarchicalLayout(const HierarchicalStorage& storage)
    : block_layouts(storage.blocks.size()),
      rank_group(are_integers(storage.precision.bases) ? HierarchicalFormat::kRankGroup : 1) {
  std::uint64_t total = 0;
  for (const TransferBlock& block : storage.blocks) {
    total += block.value_count(storage.matrix_count);
    if (is_cluster_basis(block))
      cluster_coefficient_count =
          checked_count(std::uint64_t{cluster_coefficient_count} + block.column_count);
    if (total > kMostValues) {
      throw Error("hierarchical operator: its blocks are larger than any memory");
    }
  }
  find_clusters(storage.blocks);
  place_bases(storage.blocks, storage.precision.bases);
  place_couplings(storage);
}

std::uint64_t HierarchicalLayout::filled_rank(const Cluster& cluster) const {
  return (std::uint64_t{cluster.rank} + rank_group - 1) / rank_group * rank_group;
}

std::uint64_t HierarchicalLayout::basis_index(const End& end, std::uint64_t rank,
                                              std::uint64_t position) const {
  const Cluster& cluster = clusters[end.cluster];
  const std::uint64_t r = end.coefficient - cluster.coefficient + rank;
  if (rank_group == 1) return cluster.values + r * cluster.size + position;
  constexpr std::uint64_t kGroup = HierarchicalFormat::kPositionGroup;
  const std::uint64_t begin = position / kStrip * kStrip;
  const std::uint64_t width = std::min(kStrip, cluster.size - begin);
  const std::uint64_t group = (position - begin) / kGroup;
  return cluster.values + begin * filled_rank(cluster) +
         (r / rank_group * width + kGroup * group) * rank_group + r % rank_group * kGroup +
         position % kGroup;
}

void HierarchicalLayout::find_clusters(std::span<const TransferBlock> blocks) {
  visit_ends(blocks, block_layouts,
             [&](End&, std::uint32_t begin, std::uint32_t size, std::uint32_t, std::uint32_t) {
               clusters.push_back({.begin = begin, .size = size});
             });
  std::ranges::sort(clusters, comes_before);
  const auto same = [](const Cluster& a, const Cluster& b) {
    return a.begin == b.begin && a.size == b.size;
  };
  clusters.erase(std::unique(clusters.begin(), clusters.end(), same), clusters.end());
}

std::uint32_t HierarchicalLayout::cluster_at(std::uint32_t begin, std::uint32_t size) const {
  const Cluster key{.begin = begin, .size = size};
  const auto found = std::ranges::lower_bound(clusters, key, comes_before);
  return static_cast<std::uint32_t>(found - clusters.begin());
}

void HierarchicalLayout::place_bases(std::span<const TransferBlock> blocks,
                                     BasisPrecision precision) {
  // First the offset of each end within its cluster, then the offsets of the clusters.
  visit_ends(blocks, block_layouts,
             [&](End& end, std::uint32_t begin, std::uint32_t size, std::uint32_t rank,
                 std::uint32_t residual_rank) {
               end.cluster = cluster_at(begin, size);
               end.residual_rank = precision == BasisPrecision::kQ8 ? residual_rank : 0;
               Cluster& cluster = clusters[end.cluster];
               end.coefficient = cluster.rank;
               cluster.rank = checked_count(std::uint64_t{cluster.rank} + rank + end.residual_rank);
             });
  for (Cluster& cluster : clusters) {
    cluster.coefficient = coefficient_count;
    cluster.values = basis_value_count;
    coefficient_count = checked_count(coefficient_count + filled_rank(cluster));
    basis_value_count += filled_rank(cluster) * cluster.size;
  }
  visit_ends(blocks, block_layouts,
             [&](End& end, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t) {
               end.coefficient += clusters[end.cluster].coefficient;
             });
}

void HierarchicalLayout::place_couplings(const HierarchicalStorage& storage) {
  const std::uint64_t matrix_count = storage.matrix_count;
  const auto add_coefficients = [&](End& end, std::uint32_t count) {
    end.coefficient = coefficient_count;
    coefficient_count = checked_count(std::uint64_t{coefficient_count} + count);
  };
  for (std::size_t b = 0; b < storage.blocks.size(); ++b) {
    const TransferBlock& block = storage.blocks[b];
    BlockLayout& block_layout = block_layouts[b];
    block_layout.values = coupling_value_count;
    if (block.kind == TransferBlock::Kind::kDense) {
      coupling_value_count += block.value_count(storage.matrix_count);
      add_coefficients(block_layout.row, block.row_count);
      block_layout.column = block_layout.row;
      if (!block.on_diagonal()) add_coefficients(block_layout.column, block.column_count);
      largest_scratch =
          std::max(largest_scratch, scratch_size(block.row_count, block.column_count));
      continue;
    }
    largest_scratch = std::max(largest_scratch, scratch_size(block.row_rank, block.column_rank));
    if (storage.has_packed_couplings()) {
      place_packed(storage, block, block_layout);
    } else {
      coupling_value_count += matrix_count * block.row_rank * block.column_rank;
    }
  }
  if (packed_row_count != storage.row_format.size()) {
    throw Error("hierarchical operator: there is not one format for each row of coupling matrices");
  }
}

void HierarchicalLayout::place_packed(const HierarchicalStorage& storage,
                                      const TransferBlock& block, BlockLayout& block_layout) {
  if (is_cluster_basis(block) || !has_values(block)) return;
  block_layout.values = packed_bytes;
  block_layout.first_row = packed_row_count;
  const std::uint64_t row_size = std::uint64_t{storage.matrix_count} * block.column_rank;
  packed_row_count = checked_count(std::uint64_t{packed_row_count} + block.row_rank);
  // Too few formats are found at the end.
  const std::size_t last = std::min<std::size_t>(packed_row_count, storage.row_format.size());
  for (std::size_t r = block_layout.first_row; r < last; ++r) {
    packed_bytes += RowFormat{storage.row_format[r]}.row_bytes(row_size);
  }
}

std::uint64_t HierarchicalLayout::padded(std::uint64_t value_count) {
  constexpr std::uint64_t kMultiple = 64;
  return (value_count + HierarchicalFormat::kPadding + kMultiple - 1) / kMultiple * kMultiple;
}

std::uint64_t HierarchicalLayout::padded_packed(std::uint64_t bytes) {
  constexpr std::uint64_t kMostRead = 32;
  return padded(bytes + kMostRead - HierarchicalFormat::kPadding);
}

}  // namespace rebounce
