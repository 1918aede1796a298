#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/patches/cluster_merging.h"

namespace rebounce {

/// Clusters that elements are merged into.
struct ElementClusters {
  std::vector<ElementCluster> cluster;
  std::vector<std::uint32_t> of_element;  ///< [e] number of its cluster
};

/// Makes every element a cluster of its own; `size` is that of make_cluster().
ElementClusters one_each(const Elements& elements, double size);

struct BlockSettings {
  double size;        ///< mean patch size, metres: see make_cluster()
  std::size_t least;  ///< least number of clusters that are left
  MergingLimits limits;
};

/// Merges elements within blocks of neighbours, one block after the other on each thread, as far as
/// a merging of all elements by cost would merge them in any case: to about a sixteenth of a mean
/// patch. Neighbours and queues take the memory of one block per thread.
ElementClusters merge_in_blocks(const MergingScene& scene, const BlockSettings& settings,
                                const Progress& progress);

}  // namespace rebounce
