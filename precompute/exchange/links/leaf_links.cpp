#include "precompute/exchange/links/leaf_links.h"

#include <algorithm>
#include <atomic>
#include <tuple>

#include "precompute/base/parallel_progress.h"

namespace rebounce {

struct LeafLinks::Scratch {
  std::vector<FacingPatch> facing;
  std::vector<ExchangeEntry> entries;
  PairExchange::Scratch pairs;
};

LeafLinks::LeafLinks(const LinkTree& tree, std::span<Link> links)
    : links_(links), begin_(tree.patches().size() + 1, 0) {
  for (std::size_t l = 0; l < links.size(); ++l) {
    const LinkNode &a = tree[links[l].a], &b = tree[links[l].b];
    if (!a.is_leaf() || !b.is_leaf()) continue;
    const auto [row, column] = std::minmax({tree.leaf_patch(a), tree.leaf_patch(b)});
    pairs_.push_back({row, column, l});
    ++begin_[row + 1];
  }
  std::ranges::sort(pairs_, {}, [](const Pair& pair) { return std::tie(pair.row, pair.column); });
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  count_.resize(pairs_.size(), 0);
}

void LeafLinks::count(std::uint32_t i, std::span<const MetPatch> met) {
  for (const MetPatch& m : met) {
    const auto [from, to] = std::minmax({i, m.patch});
    const auto pairs = row(from);
    const auto found = std::ranges::lower_bound(pairs, to, {}, &Pair::column);
    if (found == pairs.end() || found->column != to) continue;
    const auto k = static_cast<std::size_t>(&*found - pairs_.data());
    // Rays of a patch to itself count for both sides.
    std::atomic_ref(count_[k]).fetch_add(from == to ? 2 * m.count : m.count,
                                         std::memory_order_relaxed);
  }
}

std::uint64_t LeafLinks::measure(const PatchGeometry& geometry, const PairExchange& exchange,
                                 int probe_rays, const Progress& progress) {
  const Ranks ranks;
  const std::size_t rows = begin_.size() - 1;
  ParallelProgress loop(progress, rows);
  std::uint64_t rays = 0;
#pragma omp parallel reduction(+ : rays)
  {
    Scratch scratch;
#pragma omp for schedule(dynamic, 4)
    for (std::size_t i = 0; i < rows; ++i) {
      if (loop.stopped() || !ranks.makes(i)) continue;
      measure_row(static_cast<std::uint32_t>(i), geometry, exchange, probe_rays, scratch);
      loop.advance();
    }
    rays += scratch.pairs.ray_count;
  }
  loop.finish();
  share_areas(ranks);
  ranks.add_up(std::span(&rays, 1));
  return rays;
}

/// Gives all ranks the exchange areas of the rows that each has measured.
void LeafLinks::share_areas(const Ranks& ranks) {
  if (ranks.alone()) return;
  std::vector<decltype(Link::exchange_area)> area(pairs_.size(), 0);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    if (ranks.makes(pairs_[k].row)) area[k] = links_[pairs_[k].link].exchange_area;
  }
  ranks.add_up(std::span(area));
  for (std::size_t k = 0; k < pairs_.size(); ++k) links_[pairs_[k].link].exchange_area = area[k];
}

void LeafLinks::measure_row(std::uint32_t i, const PatchGeometry& geometry,
                            const PairExchange& exchange, int probe_rays, Scratch& scratch) {
  scratch.facing.clear();
  scratch.entries.clear();
  for (const Pair& pair : row(i)) {
    const std::uint32_t count = count_[static_cast<std::size_t>(&pair - pairs_.data())];
    if (is_coarse_pair(geometry, i, pair.column)) {
      exchange.count_coarse(i, pair.column, count, scratch.entries);
    } else {
      scratch.facing.push_back({pair.column, links_[pair.link].unoccluded_area, count});
    }
  }
  exchange.measure(i, scratch.facing, probe_rays, scratch.pairs, scratch.entries);
  std::ranges::sort(scratch.entries, {}, &ExchangeEntry::column);
  auto entry = scratch.entries.begin();
  for (const Pair& pair : row(i)) {
    const bool exchanges = entry != scratch.entries.end() && entry->column == pair.column;
    links_[pair.link].exchange_area = exchanges ? (entry++)->exchange_area : 0;
  }
}

}  // namespace rebounce
