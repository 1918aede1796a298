#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/ranks.h"
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
  /// Finds those of `links`, which must outlive the object.
  LeafLinks(const LinkTree& tree, std::span<Link> links);

  bool empty() const { return pairs_.empty(); }

  /// Counts what the hemisphere rays of patch i met, ascending. Several threads may count at once.
  void count(std::uint32_t i, std::span<const MetPatch> met);

  /// Adds up what the ranks have counted.
  void add_up_counts(const Ranks& ranks) { ranks.add_up(std::span(count_)); }

  /// Writes the exchange areas to the links, once all patches are counted. Each pair gets
  /// `probe_rays` at first. Returns the number of rays. Throws Cancelled if `progress` asks to
  /// stop.
  std::uint64_t measure(const PatchGeometry& geometry, const PairExchange& exchange, int probe_rays,
                        const Progress& progress);

 private:
  struct Pair {
    std::uint32_t row, column;  ///< patches, row <= column
    std::size_t link;
  };
  struct Scratch;

  std::span<const Pair> row(std::uint32_t i) const {
    return std::span(pairs_).subspan(begin_[i], begin_[i + 1] - begin_[i]);
  }
  void measure_row(std::uint32_t i, const PatchGeometry& geometry, const PairExchange& exchange,
                   int probe_rays, Scratch& scratch);
  void share_areas(const Ranks& ranks);

  std::span<Link> links_;
  std::vector<Pair> pairs_;           ///< ascending by row and column
  std::vector<std::size_t> begin_;    ///< [n + 1] first pair of each row
  std::vector<std::uint32_t> count_;  ///< hemisphere rays of each pair, from either side
};

}  // namespace rebounce
