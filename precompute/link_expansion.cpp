#include "link_expansion.h"

#include <algorithm>
#include <array>

#include "links_by_node.h"
#include "rebounce/precompute/parallel_progress.h"

namespace rebounce {
namespace {

class LinkExpansion {
 public:
  LinkExpansion(const LinkTree& tree, const ShadowRays& shadow_rays, std::span<const Link> links)
      : tree_(tree),
        shadow_rays_(shadow_rays),
        links_(links),
        of_node_(links_by_node(tree.nodes().size(), links.size(), [&](std::size_t k) {
          return std::array{links[k].a, links[k].b};
        })) {
    find_parents();
  }

  ExchangeRows run(const Progress& progress) const {
    ExchangeRows rows(tree_.patches().size());
    ParallelProgress loop(progress, rows.size());
    const auto nodes = tree_.nodes();
#pragma omp parallel for schedule(dynamic, 16)
    for (std::uint32_t k = 0; k < nodes.size(); ++k) {
      if (loop.stopped() || !nodes[k].is_leaf()) continue;
      expand_row(k, rows[tree_.leaf_patch(nodes[k])]);
      loop.advance();
    }
    loop.finish();
    return rows;
  }

 private:
  void find_parents() {
    const auto nodes = tree_.nodes();
    parent_.assign(nodes.size(), kNone);
    for (std::uint32_t k = 0; k < nodes.size(); ++k) {
      if (nodes[k].is_leaf()) continue;
      parent_[nodes[k].first_child] = parent_[nodes[k].first_child + 1] = k;
    }
  }

  void expand_row(std::uint32_t leaf, std::vector<ExchangeEntry>& row) const {
    const std::uint32_t i = tree_.leaf_patch(tree_[leaf]);
    for (std::uint32_t node = leaf; node != kNone; node = parent_[node]) {
      for (const std::uint32_t k : of_node_[node]) {
        const Link& link = links_[k];
        if (link.exchange_area <= 0) continue;
        const LinkNode& other = tree_[link.a == node ? link.b : link.a];
        for (const std::uint32_t j : tree_.patches(other)) {
          if (j >= i) append(link, i, j, row);
        }
      }
    }
    std::ranges::sort(row, {}, &ExchangeEntry::column);
  }

  void append(const Link& link, std::uint32_t i, std::uint32_t j,
              std::vector<ExchangeEntry>& row) const {
    ExchangeEntry entry{j, link.exchange_area, link.unoccluded_area, link.visibility_variance};
    if (!tree_[link.a].is_leaf() || !tree_[link.b].is_leaf()) {
      const double unoccluded = shadow_rays_.unoccluded(i, j);
      const double visible = link.exchange_area / link.unoccluded_area;
      entry.exchange_area = static_cast<float>(visible * unoccluded);
      entry.unoccluded_area = static_cast<float>(unoccluded);
    }
    if (entry.exchange_area > 0) row.push_back(entry);
  }

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  const std::span<const Link> links_;
  LinksByNode of_node_;
  std::vector<std::uint32_t> parent_;
};

}  // namespace

ExchangeRows expand_links(const LinkTree& tree, const ShadowRays& shadow_rays,
                          std::span<const Link> links, const Progress& progress) {
  return LinkExpansion(tree, shadow_rays, links).run(progress);
}

}  // namespace rebounce
