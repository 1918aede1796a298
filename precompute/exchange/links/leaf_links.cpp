#include "precompute/exchange/links/leaf_links.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <tuple>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"

namespace rebounce {

struct LeafLinks::Scratch {
  std::vector<FacingPatch> facing;
  std::vector<ExchangeEntry> entries;
  PairExchange::Scratch pairs;
};

LeafLinks::LeafLinks(const LinkTree& tree, const PatchGeometry& geometry, std::span<Link> links)
    : geometry_(geometry), links_(links), begin_(tree.patches().size() + 1, 0) {
  const auto patches_of = [&](const Link& link) {
    return std::minmax({tree.leaf_patch(tree[link.a()]), tree.leaf_patch(tree[link.b()])});
  };
  const auto is_measured_now = [&](const Link& link) {
    if (!link.joins_patches()) return false;
    const auto [row, column] = patches_of(link);
    return link.of_patches().measured_area < 0 || is_coarse_pair(geometry, row, column);
  };
  pairs_.reserve(static_cast<std::size_t>(std::ranges::count_if(links, is_measured_now)));
  for (std::uint32_t l = 0; l < links.size(); ++l) {
    if (!is_measured_now(links[l])) continue;
    const auto [row, column] = patches_of(links[l]);
    pairs_.push_back({row, column, l});
    ++begin_[row + 1];
  }
  std::ranges::sort(pairs_, {}, [](const Pair& pair) { return std::tie(pair.row, pair.column); });
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
}

void LeafLinks::count(const HemisphereCounts& hemispheres) {
  count_.assign(pairs_.size(), 0);
  hemispheres.for_each_patch([&](std::uint32_t i, std::span<const MetPatch> met) {
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
  });
  Ranks().add_up(std::span(count_));
}

std::vector<double> LeafLinks::counted_variance(const CountedExchange& counted) const {
  std::vector<double> sum(begin_.size() - 1, 0.0);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const std::uint32_t i = pairs_[k].row, j = pairs_[k].column;
    if (!is_coarse_pair(geometry_, i, j)) continue;
    const double found = counted.exchange(i, j, count_[k]);
    const double variance = counted.variance(i, j, found) / (geometry_.area(i) * geometry_.area(j));
    sum[i] += variance;
    if (j != i) sum[j] += variance;
  }
  return sum;
}

std::uint64_t LeafLinks::measure(const PairExchange& exchange, int probe_rays,
                                 const Progress& progress) {
  const Ranks ranks;
  const std::size_t rows = begin_.size() - 1;
  std::size_t pairs = 0;
  for (std::uint32_t i = 0; i < rows; ++i) pairs += ranks.makes(i) ? row(i).size() : 0;
  ParallelProgress loop(progress, pairs);
  std::atomic<std::uint64_t> traced = 0;
  parallel_loop(
      rows, 4, [] { return Scratch(); },
      [&](std::uint32_t i, Scratch& scratch) {
        if (loop.stopped() || !ranks.makes(i)) return;
        measure_row(i, exchange, probe_rays, scratch);
        traced += std::exchange(scratch.pairs.ray_count, 0);
        loop.advance(row(i).size());
      });
  loop.finish();
  std::uint64_t rays = traced;
  share_measured(ranks);
  ranks.add_up(std::span(&rays, 1));
  return rays;
}

/// Gives all ranks what each has measured of its rows.
void LeafLinks::share_measured(const Ranks& ranks) {
  if (ranks.alone()) return;
  std::vector<std::vector<std::array<float, 2>>> by_row(begin_.size() - 1);
  for (const Pair& pair : pairs_) {
    const Link& link = links_[pair.link];
    by_row[pair.row].push_back({link.exchange_area, link.of_patches().variance});
  }
  ranks.share(std::span(by_row));
  for (std::uint32_t i = 0; i < by_row.size(); ++i) {
    auto next = by_row[i].begin();
    for (const Pair& pair : row(i)) {
      const auto [area, variance] = *next++;
      links_[pair.link].set_measured(area, variance);
    }
  }
}

void LeafLinks::measure_row(std::uint32_t i, const PairExchange& exchange, int probe_rays,
                            Scratch& scratch) {
  scratch.facing.clear();
  scratch.entries.clear();
  for (const Pair& pair : row(i)) {
    const std::uint32_t count = count_[static_cast<std::size_t>(&pair - pairs_.data())];
    if (is_coarse_pair(geometry_, i, pair.column)) {
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
    if (exchanges) {
      links_[pair.link].set_measured(entry->exchange_area, static_cast<float>(entry->variance()));
      ++entry;
    } else {
      links_[pair.link].set_measured(0, 0);
    }
  }
}

}  // namespace rebounce
