#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/exchange/pairs/pair_exchange.h"

namespace rebounce {

/// Links with the number of hemisphere rays that passed each, from either side. Two things follow
/// from these (lab/117):
/// - Links between two single patches are measured as pairs of patches are, by shadow rays and
///   counts together (pair_exchange.h). Most of the light of near surfaces passes them.
/// - A link that all shadow rays found hidden has the exchange that the counts tell of. Such links
///   are many, and what they miss is always light.
class CountedLinks {
 public:
  /// A link of a patch: the positions of the node at its other end.
  struct Passage {
    std::uint32_t begin, end;
    std::size_t link;
  };
  struct Scratch {
    std::vector<Passage> passages;
  };

  /// Both must outlive the object; the links that `links` stand for do not change.
  CountedLinks(const LinkTree& tree, std::span<Link> links);

  bool empty() const { return links_.empty(); }

  /// Counts what the hemisphere rays of patch i met. Several threads may count at once, each with
  /// its own scratch.
  void count(std::uint32_t i, std::span<const MetPatch> met, Scratch& scratch);

  /// Writes exchange areas to the links, once all patches are counted, of `ray_count` rays each.
  /// Each pair of patches gets `probe_rays` at first. Returns the number of rays. Throws Cancelled
  /// if `progress` asks to stop.
  std::uint64_t measure(const PatchGeometry& geometry, const PairExchange& exchange, int ray_count,
                        int probe_rays, const Progress& progress);

 private:
  struct Pair {
    std::uint32_t row, column;  ///< patches, row <= column
    std::size_t link;
  };
  struct RowScratch;

  void sort_by_node();
  void find_pairs();
  void reveal(Link& link, std::uint32_t count, int ray_count) const;
  std::span<const Pair> row(std::uint32_t i) const {
    return std::span(pairs_).subspan(first_pair_[i], first_pair_[i + 1] - first_pair_[i]);
  }
  void measure_row(std::uint32_t i, const PatchGeometry& geometry, const PairExchange& exchange,
                   int probe_rays, RowScratch& scratch);

  const LinkTree& tree_;
  std::span<Link> links_;
  std::vector<std::uint32_t> position_;     ///< [n] of each patch
  std::vector<std::uint32_t> parent_;       ///< [m] of each node
  std::vector<std::uint32_t> leaf_;         ///< [n] node of each patch
  std::vector<std::size_t> first_of_node_;  ///< [m + 1] into of_node_
  std::vector<std::size_t> of_node_;        ///< the links of each node
  std::vector<Pair> pairs_;                 ///< links between patches, ascending by row and column
  std::vector<std::size_t> first_pair_;     ///< [n + 1] of each row
  std::vector<std::uint32_t> count_;        ///< [l] rays of each link
};

}  // namespace rebounce
