#include "precompute/exchange/links/counted_links.h"

#include <algorithm>
#include <atomic>
#include <tuple>

#include "precompute/base/parallel_progress.h"

namespace rebounce {

struct CountedLinks::RowScratch {
  std::vector<FacingPatch> facing;
  std::vector<ExchangeEntry> entries;
  PairExchange::Scratch pairs;
};

CountedLinks::CountedLinks(const LinkTree& tree, std::span<Link> links)
    : tree_(tree),
      links_(links),
      position_(tree.patches().size()),
      parent_(tree.nodes().size(), kNone),
      leaf_(tree.patches().size()),
      count_(links.size(), 0) {
  for (std::uint32_t p = 0; p < position_.size(); ++p) position_[tree.patches()[p]] = p;
  for (std::uint32_t k = 0; k < parent_.size(); ++k) {
    const LinkNode& node = tree[k];
    if (node.is_leaf()) {
      leaf_[tree.leaf_patch(node)] = k;
    } else {
      parent_[node.first_child] = parent_[node.first_child + 1] = k;
    }
  }
  sort_by_node();
  find_pairs();
}

void CountedLinks::sort_by_node() {
  first_of_node_.assign(tree_.nodes().size() + 1, 0);
  const auto for_each_end = [&](const auto& visit) {
    for (std::size_t l = 0; l < links_.size(); ++l) {
      visit(links_[l].a, l);
      if (links_[l].b != links_[l].a) visit(links_[l].b, l);
    }
  };
  for_each_end([&](std::uint32_t node, std::size_t) { ++first_of_node_[node + 1]; });
  for (std::size_t k = 1; k < first_of_node_.size(); ++k)
    first_of_node_[k] += first_of_node_[k - 1];
  of_node_.resize(first_of_node_.back());
  std::vector<std::size_t> next(first_of_node_.begin(), first_of_node_.end() - 1);
  for_each_end([&](std::uint32_t node, std::size_t l) { of_node_[next[node]++] = l; });
}

void CountedLinks::find_pairs() {
  first_pair_.assign(position_.size() + 1, 0);
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const LinkNode &a = tree_[links_[l].a], &b = tree_[links_[l].b];
    if (!a.is_leaf() || !b.is_leaf()) continue;
    const auto [row, column] = std::minmax({tree_.leaf_patch(a), tree_.leaf_patch(b)});
    pairs_.push_back({row, column, l});
    ++first_pair_[row + 1];
  }
  std::ranges::sort(pairs_, {}, [](const Pair& pair) { return std::tie(pair.row, pair.column); });
  for (std::size_t i = 1; i < first_pair_.size(); ++i) first_pair_[i] += first_pair_[i - 1];
}

void CountedLinks::count(std::uint32_t i, std::span<const MetPatch> met, Scratch& scratch) {
  std::vector<Passage>& passages = scratch.passages;
  passages.clear();
  for (std::uint32_t node = leaf_[i]; node != kNone; node = parent_[node]) {
    for (std::size_t k = first_of_node_[node]; k < first_of_node_[node + 1]; ++k) {
      const Link& link = links_[of_node_[k]];
      const LinkNode& other = tree_[link.a == node ? link.b : link.a];
      passages.push_back({other.begin, other.begin + other.count, of_node_[k]});
    }
  }
  // Every pair of patches is in at most one link, so that these do not overlap.
  std::ranges::sort(passages, {}, &Passage::begin);
  for (const MetPatch& m : met) {
    const std::uint32_t position = position_[m.patch];
    const auto after = std::ranges::upper_bound(passages, position, {}, &Passage::begin);
    if (after == passages.begin() || position >= std::prev(after)->end) continue;
    // Rays of a patch to itself count for both sides.
    std::atomic_ref(count_[std::prev(after)->link])
        .fetch_add(m.patch == i ? 2 * m.count : m.count, std::memory_order_relaxed);
  }
}

/// N rays of each of n_a patches of area A_a in all, and of n_b of A_b, meet the other node
/// N (n_a / A_a + n_b / A_b) S times if the nodes exchange S m².
void CountedLinks::reveal(Link& link, std::uint32_t count, int ray_count) const {
  const LinkNode &a = tree_[link.a], &b = tree_[link.b];
  const double met = ray_count * (a.count / a.area + b.count / b.area);
  link.exchange_area = static_cast<float>(std::min<double>(link.unoccluded_area, count / met));
}

std::uint64_t CountedLinks::measure(const PatchGeometry& geometry, const PairExchange& exchange,
                                    int ray_count, int probe_rays, const Progress& progress) {
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const bool hidden = links_[l].exchange_area <= 0;
    if (hidden && count_[l] > 0) reveal(links_[l], count_[l], ray_count);
  }
  const std::size_t rows = position_.size();
  ParallelProgress loop(progress, rows);
  std::uint64_t rays = 0;
#pragma omp parallel reduction(+ : rays)
  {
    RowScratch scratch;
#pragma omp for schedule(dynamic, 4)
    for (std::size_t i = 0; i < rows; ++i) {
      if (loop.stopped()) continue;
      measure_row(static_cast<std::uint32_t>(i), geometry, exchange, probe_rays, scratch);
      loop.advance();
    }
    rays += scratch.pairs.ray_count;
  }
  loop.finish();
  return rays;
}

void CountedLinks::measure_row(std::uint32_t i, const PatchGeometry& geometry,
                               const PairExchange& exchange, int probe_rays, RowScratch& scratch) {
  scratch.facing.clear();
  scratch.entries.clear();
  for (const Pair& pair : row(i)) {
    const std::uint32_t count = count_[pair.link];
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
