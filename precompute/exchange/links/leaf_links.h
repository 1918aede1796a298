#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/ranks.h"
#include "precompute/exchange/links/hemisphere_counts.h"
#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/exchange/pairs/pair_exchange.h"

namespace rebounce {

/// The links between two single patches, which are measured as pairs of patches are, by shadow rays
/// and hemisphere rays together (pair_exchange.h). Most of the light of near surfaces passes them
/// (lab/117).
class LeafLinks {
 public:
  /// Finds those of `links` that are still to be measured, and those of near pairs of many
  /// triangles, of which hemisphere rays alone tell ("coarse"). All arguments must outlive the
  /// object.
  LeafLinks(const LinkTree& tree, const PatchGeometry& geometry, std::span<Link> links);

  /// Counts the hemisphere rays that join the patches of each link.
  void count(const HemisphereCounts& hemispheres);

  /// The variance of coarse links, as counted: for each patch [n] that of its entries of
  /// A^1/2 F A^-1/2, added up.
  std::vector<double> counted_variance(const CountedExchange& counted) const;

  /// Writes the exchange areas to the links, once rays are counted. Each pair gets `probe_rays` at
  /// first. Returns the number of rays. Throws Cancelled if `progress` asks to stop.
  std::uint64_t measure(const PairExchange& exchange, int probe_rays, const Progress& progress);

 private:
  struct Pair {
    std::uint32_t row, column;  ///< patches, row <= column
    std::uint32_t link;
  };
  struct Scratch;

  std::span<const Pair> row(std::uint32_t i) const {
    return std::span(pairs_).subspan(begin_[i], begin_[i + 1] - begin_[i]);
  }
  void measure_row(std::uint32_t i, const PairExchange& exchange, int probe_rays, Scratch& scratch);
  void share_measured(const Ranks& ranks);

  const PatchGeometry& geometry_;
  std::span<Link> links_;
  std::vector<Pair> pairs_;           ///< ascending by row and column
  std::vector<std::size_t> begin_;    ///< [n + 1] first pair of each row
  std::vector<std::uint32_t> count_;  ///< hemisphere rays of each pair, from either side
};

}  // namespace rebounce
