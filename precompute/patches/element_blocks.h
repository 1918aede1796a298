#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/patches/cluster_merging.h"

namespace rebounce {

/// Clusters that elements were merged into.
struct ElementClusters {
  std::vector<Cluster> cluster;
  std::vector<std::uint32_t> of_element;  ///< [e]
};

/// Every element a cluster of its own. `size` as for make_cluster().
ElementClusters one_each(const Elements& elements, double size);

struct BlockSettings {
  double size;        ///< the mean patch's, metres: see make_cluster()
  std::size_t least;  ///< leave no fewer clusters
  MergingLimits limits;
};

/// Merges elements within blocks of neighbours, one after the other on each thread, as far as
/// merging all of them the cheapest first would do in any case: to about a sixteenth of a mean
/// patch. Memory for neighbours and queues is that of one block for each thread.
ElementClusters merge_in_blocks(const MergingScene& scene, const BlockSettings& settings,
                                const Progress& progress);

}  // namespace rebounce
