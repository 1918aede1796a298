#include "precompute/exchange/links/link_fitting.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "precompute/exchange/links/affine_links.h"
#include "precompute/exchange/links/link_choice.h"
#include "precompute/exchange/links/pair_sums.h"
#include "precompute/patches/cluster_tree.h"
#include "rebounce/error.h"
#include "transfer/base/disjoint_sets.h"

namespace rebounce {
namespace {

// The largest rooms have groups of their own in the tree; all others share the last group.
constexpr std::size_t kRoomGroups = 255;

std::vector<std::uint32_t> numbers_of(DisjointSets& sets, std::size_t count) {
  std::vector<std::uint32_t> number(count);
  for (std::uint32_t i = 0; i < count; ++i) number[i] = sets.find(i);
  return number;
}

/// [n] The number of the room of each patch. Light can reach all patches of a room from each other,
/// directly or by reflection.
std::vector<std::uint32_t> find_rooms(const ExchangeMatrix& exchange) {
  const auto n = static_cast<std::uint32_t>(exchange.patch_count());
  DisjointSets sets(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      sets.join(i, exchange.column[k]);
    }
  }
  return numbers_of(sets, n);
}

/// The same from links.
std::vector<std::uint32_t> find_rooms(const LinkedFormFactors& links) {
  const LinkedNodes& tree = links.nodes();
  const std::span<const std::uint32_t> begin = links.first_positions();
  DisjointSets sets(static_cast<std::uint32_t>(tree.patch.size()));
  const auto first_patch = [&](std::uint32_t node) { return tree.patch[begin[node]]; };
  for (std::uint32_t node = 0; node < begin.size(); ++node) {
    if (links.plain_links(node).empty() && links.affine_links(node).empty()) continue;
    for (std::uint32_t k = 1; k < tree.count[node]; ++k) {
      sets.join(first_patch(node), tree.patch[begin[node] + k]);
    }
    links.for_each_link(node, [&](const IncomingLink& link) {
      sets.join(first_patch(node), first_patch(link.from));
    });
  }
  return numbers_of(sets, tree.patch.size());
}

/// [n] Groups for the tree, so that most nodes are of one room: each of the largest rooms is a
/// group.
std::vector<std::uint8_t> room_groups(std::span<const std::uint32_t> room) {
  std::vector<std::uint32_t> size(room.size(), 0), rooms;
  for (const std::uint32_t r : room) {
    if (size[r]++ == 0) rooms.push_back(r);
  }
  std::ranges::sort(rooms, [&](std::uint32_t a, std::uint32_t b) {
    return size[a] != size[b] ? size[a] > size[b] : a < b;
  });
  std::vector<std::uint8_t> group_of_room(room.size(), kRoomGroups), group(room.size());
  for (std::size_t k = 0; k < std::min(kRoomGroups, rooms.size()); ++k) {
    group_of_room[rooms[k]] = static_cast<std::uint8_t>(k);
  }
  for (std::size_t i = 0; i < room.size(); ++i) group[i] = group_of_room[room[i]];
  return group;
}

/// The room that contains all patches of each node, or kNone.
std::vector<std::uint32_t> rooms_of_nodes(const ClusterTree& tree,
                                          std::span<const std::uint32_t> room) {
  std::vector<std::uint32_t> of_node(tree.clusters.size());
  for (std::size_t k = of_node.size(); k-- > 0;) {
    const Cluster& cluster = tree.clusters[k];
    if (cluster.is_leaf()) {
      of_node[k] = room[tree.patch[cluster.begin]];
    } else {
      const std::uint32_t first = of_node[cluster.first_child];
      of_node[k] = first == of_node[cluster.first_child + 1] ? first : kNone;
    }
  }
  return of_node;
}

/// The row sums of F, and the squared Frobenius norm of A^1/2 F A^-1/2.
struct Totals {
  std::vector<float> row_sum;
  double squared = 0;
};

Totals totals_of(const ExchangeMatrix& exchange, const std::vector<float>& area) {
  std::vector<double> sum(area.size());
  Totals totals;
  for (std::uint32_t i = 0; i < area.size(); ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = exchange.column[k];
      const double value = exchange.exchange_area[k];
      sum[i] += value / area[i];
      if (j != i) sum[j] += value / area[j];
      totals.squared += (i == j ? 1 : 2) * value * value / (static_cast<double>(area[i]) * area[j]);
    }
  }
  totals.row_sum.assign(sum.begin(), sum.end());
  return totals;
}

/// The same from links, whose nodes have these spreads; the norm leaves out what patches lose by
/// their scales.
Totals totals_of(const LinkedFormFactors& links, std::span<const NodeSpread> nodes) {
  Totals totals{row_sums(links), 0};
  for (std::uint32_t node = 0; node < nodes.size(); ++node) {
    links.for_each_link(node, [&](const IncomingLink& link) {
      totals.squared += squared_norm(affine_link(node, link), nodes[node], nodes[link.from]);
    });
  }
  return totals;
}

FormFactorLinks without_links(const ClusterTree& tree) {
  FormFactorLinks links;
  links.patch = tree.patch;
  for (const Cluster& cluster : tree.clusters) {
    links.first_child.push_back(cluster.first_child);
    links.count.push_back(cluster.count);
  }
  links.scale.assign(tree.patch.size(), 1);
  return links;
}

void check_error_per_link(double error_per_link) {
  if (!(error_per_link > 0) || !std::isfinite(error_per_link)) {
    throw Error("links: error_per_link must be above 0 and finite");
  }
}

ClusterTree tree_of(const LinkedFormFactors& links) {
  const LinkedNodes& nodes = links.nodes();
  const std::span<const std::uint32_t> begin = links.first_positions();
  ClusterTree tree;
  tree.patch = nodes.patch;
  for (std::size_t k = 0; k < begin.size(); ++k) {
    tree.clusters.push_back(
        {.begin = begin[k], .count = nodes.count[k], .first_child = nodes.first_child[k]});
  }
  return tree;
}

/// The tree that links are chosen for; `room` [n].
SpreadTree spread_tree(ClusterTree clusters, const PatchTable& patches,
                       const std::vector<std::uint32_t>& room) {
  SpreadTree tree{std::move(clusters), {}, {}};
  tree.room = rooms_of_nodes(tree.tree, room);
  tree.spread = spread_nodes(without_links(tree.tree), patches.area, patches.centroid);
  return tree;
}

FormFactorLinks fit(const SpreadTree& tree, const PairSource& pairs, const Totals& totals,
                    const PatchTable& patches, double error_per_link, const Progress& progress) {
  const double multiplier =
      error_per_link * error_per_link * totals.squared / static_cast<double>(patches.size());
  FormFactorLinks links = without_links(tree.tree);
  for (const auto& of_block : choose_links(tree, pairs, patches, multiplier, progress)) {
    for (const AffineLink& link : of_block) append_link(link, links);
  }
  scale_rows(totals.row_sum, patches.area, patches.centroid, links);
  return links;
}

}  // namespace

FormFactorLinks fit_links(const ExchangeMatrix& exchange, const PatchTable& patches,
                          double error_per_link, const Progress& progress) {
  if (exchange.patch_count() != patches.size() || patches.size() == 0) {
    throw Error("links: form factors and patches differ in number");
  }
  check_error_per_link(error_per_link);
  const std::vector<std::uint32_t> room = find_rooms(exchange);
  const SpreadTree tree =
      spread_tree(build_cluster_tree(patches, 1, 1, room_groups(room)), patches, room);
  return fit(tree, SortedPairs(exchange, tree.tree.patch), totals_of(exchange, patches.area),
             patches, error_per_link, progress);
}

FormFactorLinks fit_links(const std::shared_ptr<const LinkedFormFactors>& links,
                          const PatchTable& patches, double error_per_link,
                          const Progress& progress) {
  check_error_per_link(error_per_link);
  const LinkedPairs pairs(links, patches);
  // The fit reuses the tree of `links`: in another tree, links would be cut where its nodes end.
  const SpreadTree tree = spread_tree(tree_of(*links), patches, find_rooms(*links));
  return fit(tree, pairs, totals_of(*links, tree.spread), patches, error_per_link, progress);
}

}  // namespace rebounce
