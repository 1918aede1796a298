#include "precompute/patches/element_blocks.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>

#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlockSize = 1 << 12;  // elements; lab/028: their data fits into a cache

// Each element's nearest others that may join it without a shared edge.
constexpr std::size_t kNeighbourBlockCount = 8;

// Merging two flat squares into a patch of the mean area costs size^4 / 8. Mergings up to this
// fraction of it leave clusters of a sixteenth of that area.
constexpr double kBlockCost = 1.0 / 256;

using Steps = std::vector<ClusterMerging::Step>;

class BlockMerging {
 public:
  BlockMerging(const MergingScene& scene, const BlockSettings& settings)
      : scene_(scene),
        settings_(settings),
        order_(scene.elements.size()),
        place_(order_.size()),
        limits_(settings.limits) {
    limits_.cost = kBlockCost * std::pow(settings.size, 4) / 8;
    std::iota(order_.begin(), order_.end(), 0U);
    begin_.push_back(0);
    split(0, order_.size());
    for (std::uint32_t k = 0; k < order_.size(); ++k) place_[order_[k]] = k;
  }

  ElementClusters run(const Progress& progress) {
    std::vector<Steps> steps(block_count());
    const auto batch = 4 * static_cast<std::size_t>(omp_get_max_threads());
    for (std::size_t first = 0; first < steps.size(); first += batch) {
      report_progress(progress, static_cast<double>(first) / static_cast<double>(steps.size()));
      const std::size_t end = std::min(first + batch, steps.size());
#pragma omp parallel for schedule(dynamic, 1)
      for (std::size_t b = first; b < end; ++b) steps[b] = merge_block(b);
    }
    leave_enough(steps);
    return redo(steps);
  }

 private:
  std::size_t block_count() const {
    return begin_.size() - 1;
  }

  std::span<const std::uint32_t> block(std::size_t b) const {
    return std::span(order_).subspan(begin_[b], begin_[b + 1] - begin_[b]);
  }

  /// Halves a range of elements along the longest axis of the box around their centroids until it
  /// is a block.
  void split(std::size_t begin, std::size_t end) {
    if (end - begin <= kBlockSize) {
      begin_.push_back(static_cast<std::uint32_t>(end));
      return;
    }
    Box box;
    for (std::size_t k = begin; k < end; ++k) box.add(to_glm(scene_.elements.centroid(order_[k])));
    const glm::vec3 size = box.extent();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::ranges::nth_element(at(begin), at(middle), at(end), {}, [&](std::uint32_t e) {
      return std::pair(scene_.elements.centroid(e)[axis], e);
    });
    split(begin, middle);
    split(middle, end);
  }

  std::vector<ElementCluster> start_clusters(std::size_t b) const {
    std::vector<ElementCluster> clusters;
    for (const std::uint32_t e : block(b)) {
      clusters.push_back(make_cluster(scene_.elements, e, settings_.size));
    }
    return clusters;
  }

  Steps merge_block(std::size_t b) const {
    std::vector<Uint3> corner;
    std::vector<Float3> centroid;
    for (const std::uint32_t e : block(b)) {
      corner.push_back(scene_.elements.corner[e]);
      centroid.push_back(scene_.elements.centroid(e));
    }
    ClusterMerging merging(scene_, start_clusters(b), place_, begin_[b]);
    merging.set_limits(limits_);
    const Pairs edges = find_edge_neighbours(corner);
    const Pairs near =
        find_near_pairs(centroid, kNeighbourBlockCount, static_cast<float>(settings_.size));
    Pairs apart;
    std::ranges::set_difference(near, edges, std::back_inserter(apart));
    merging.connect(edges);
    merging.connect_in_sight(apart);
    merging.merge_cheapest(1);
    return merging.steps();
  }

  /// Undoes the steps of highest cost if too many were done.
  void leave_enough(std::vector<Steps>& steps) const {
    std::size_t count = 0;
    for (const Steps& s : steps) count += s.size();
    if (order_.size() - count >= settings_.least) return;
    const std::size_t allowed =
        order_.size() > settings_.least ? order_.size() - settings_.least : 0;
    std::vector<float> height;
    height.reserve(count);
    for (const Steps& of_block : steps) {
      for (const ClusterMerging::Step& s : of_block) height.push_back(s.height);
    }
    const auto limit = height.begin() + static_cast<std::ptrdiff_t>(allowed);
    std::ranges::nth_element(height, limit);
    // The heights of a block never decrease.
    for (Steps& of_block : steps) {
      std::erase_if(of_block, [&](const ClusterMerging::Step& s) { return s.height >= *limit; });
    }
  }

  ElementClusters redo(const std::vector<Steps>& steps) const {
    ElementClusters result;
    result.of_element.resize(order_.size());
    for (std::size_t b = 0; b < steps.size(); ++b) {
      std::vector<ElementCluster> cluster = start_clusters(b);
      std::vector<std::uint32_t> number(cluster.size() + steps[b].size(), kNone);
      std::vector<std::uint32_t> into(number.size(), kNone);
      for (const ClusterMerging::Step& s : steps[b]) {
        into[s.a] = into[s.b] = static_cast<std::uint32_t>(cluster.size());
        cluster.push_back(join(scene_.elements, cluster[s.a], cluster[s.b]));
      }
      for (std::size_t c = cluster.size(); c-- > 0;) {  // merged clusters come after their parts
        if (into[c] != kNone) {
          number[c] = number[into[c]];
          continue;
        }
        number[c] = static_cast<std::uint32_t>(result.cluster.size());
        result.cluster.push_back(cluster[c]);
      }
      for (std::size_t k = 0; k < block(b).size(); ++k) result.of_element[block(b)[k]] = number[k];
    }
    return result;
  }

  const MergingScene& scene_;
  const BlockSettings& settings_;
  std::vector<std::uint32_t> order_;  ///< elements, block by block
  std::vector<std::uint32_t> place_;  ///< [e] in order_
  std::vector<std::uint32_t> begin_;  ///< of each block in order_
  MergingLimits limits_;
};

}  // namespace

ElementClusters one_each(const Elements& elements, double size) {
  ElementClusters clusters;
  clusters.cluster.reserve(elements.size());
  for (std::uint32_t e = 0; e < elements.size(); ++e) {
    clusters.cluster.push_back(make_cluster(elements, e, size));
    clusters.of_element.push_back(e);
  }
  return clusters;
}

ElementClusters merge_in_blocks(const MergingScene& scene, const BlockSettings& settings,
                                const Progress& progress) {
  return BlockMerging(scene, settings).run(progress);
}

}  // namespace rebounce
