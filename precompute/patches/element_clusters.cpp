#include "precompute/patches/element_clusters.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "precompute/patches/cluster_merging.h"
#include "precompute/patches/element_blocks.h"
#include "precompute/patches/element_neighbours.h"
#include "runtime/rays/float3_glm.h"
#include "transfer/base/disjoint_sets.h"

namespace rebounce {
namespace {

// Elements are merged in blocks first if there are more than kFewElements of them and more than
// kManyElements per patch; at least kLeastClusters clusters per patch are left then.
constexpr std::size_t kFewElements = 1 << 16, kManyElements = 16, kLeastClusters = 8;

// Each cluster's nearest others that may join it without a shared edge.
constexpr std::size_t kNearCount = 8;

// A patch is at most this number of mean sizes long. Without this limit the walls around things
// that must not merge would merge at any cost, because the leak test leaves few other pairs.
constexpr double kLongest = 4;

// Clusters up to these fractions of the mean size merge without leak test; may merge around
// themselves; hide nothing.
constexpr double kDetail = 1.0 / 16, kSmall = 0.5, kThing = 0.5;

// A cluster below this fraction of the mean area may join neighbours that it does not see. Lying on
// two sides of a wall costs like a distance of kWall mean sizes: patches may be half as long, so
// that relevant surfaces are kept apart, while fragments, which hidden places have by the thousand,
// are not (lab/022, lab/025).
constexpr double kFragment = 1.0 / 16, kWall = 8;

// Rounds in which patches that lie near each other become neighbours, while there are too many
// patches. In the last rounds the longest patch doubles each time.
constexpr int kRounds = 8, kRoundsOfLength = 6;

// The fraction of the progress for blocks.
constexpr double kBlocksProgress = 0.6;

class ElementMerging {
 public:
  ElementMerging(const Elements& elements, const RayTracer& tracer, const ClusterSettings& settings)
      : scene_{elements, tracer, {}, {}}, settings_(settings) {
    const double area = std::inner_product(elements.area.begin(), elements.area.end(),
                                           elements.density_weight.begin(), 0.0);
    size_ = settings.patch_count > 0 ? std::sqrt(area / static_cast<double>(settings.patch_count))
                                     : settings.largest;
    limits_ = {.detail = kDetail * size_,
               .small = kSmall * size_,
               .largest = 0,
               .thing = kThing * size_,
               .fragment = kFragment * size_ * size_,
               .wall = kWall * size_};
    set_largest(kLongest * size_);
    scene_.elements_of.assign(1 + *std::ranges::max_element(elements.triangle), {kNone, kNone});
    for (std::uint32_t e = 0; e < elements.size(); ++e) {
      auto& sides = scene_.elements_of[elements.triangle[e]];
      sides[sides[0] == kNone ? 0 : 1] = e;
    }
  }

  ElementPatches run(const Progress& progress) {
    Pairs edges = find_edge_neighbours(scene_.elements.corner);
    measure_pieces(edges);
    const ElementClusters start = start_clusters(progress);
    ClusterMerging merging(scene_, start.cluster, start.of_element, 0);
    merging.set_limits(limits_);
    connect(start, std::move(edges), merging);
    const std::size_t wanted = std::max<std::size_t>(settings_.patch_count, 1);
    const auto watch = [&, first = merging.alive_count()](std::size_t alive) {
      const double done = static_cast<double>(first - alive) /
                          static_cast<double>(std::max(first, wanted + 1) - wanted);
      report_progress(progress, kBlocksProgress + (1 - kBlocksProgress) * std::min(done, 1.0));
    };
    merging.merge_cheapest(wanted, watch);
    for (int round = 1; round <= kRounds && merging.alive_count() > settings_.patch_count;
         ++round) {
      start_round(round, merging);
      merging.merge_cheapest(wanted, watch);
    }
    return result(start, merging);
  }

 private:
  void set_largest(double length) {
    limits_.largest = settings_.largest > 0 ? std::min<double>(settings_.largest, length) : length;
  }

  /// Finds the length of the connected piece of the mesh that each element belongs to.
  void measure_pieces(const Pairs& edges) {
    const Elements& elements = scene_.elements;
    DisjointSets pieces(elements.size());
    for (const auto& [a, b] : edges) pieces.join(a, b);
    // The box around each piece, by the element that represents it.
    std::vector<glm::vec3> low(elements.size()), high(elements.size());
    for (std::uint32_t e = 0; e < elements.size(); ++e) {
      low[e] = elements.low(e);
      high[e] = elements.high(e);
    }
    for (std::uint32_t e = 0; e < elements.size(); ++e) {
      const std::uint32_t piece = pieces.find(e);
      low[piece] = glm::min(low[piece], elements.low(e));
      high[piece] = glm::max(high[piece], elements.high(e));
    }
    for (std::uint32_t e = 0; e < elements.size(); ++e) {
      const std::uint32_t piece = pieces.find(e);
      scene_.piece_length.push_back(glm::distance(low[piece], high[piece]));
    }
  }

  ElementClusters start_clusters(const Progress& progress) const {
    const std::size_t count = std::max<std::size_t>(settings_.patch_count, 1);
    if (scene_.elements.size() < std::max(kFewElements, kManyElements * count)) {
      return one_each(scene_.elements, size_);
    }
    return merge_in_blocks(scene_, {size_, kLeastClusters * count, limits_},
                           part_of(progress, 0, kBlocksProgress));
  }

  /// Makes clusters neighbours that share an edge, or that lie near each other and see each other.
  void connect(const ElementClusters& start, Pairs edges, ClusterMerging& merging) const {
    for (auto& [a, b] : edges) {
      const auto [low, high] = std::minmax(start.of_element[a], start.of_element[b]);
      std::tie(a, b) = std::pair(low, high);
    }
    std::erase_if(edges, [](const auto& pair) { return pair.first == pair.second; });
    std::ranges::sort(edges);
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    merging.connect(edges);
    std::vector<Float3> centroid;
    for (const ElementCluster& cluster : start.cluster)
      centroid.push_back(to_float3(cluster.centroid()));
    const Pairs near = find_near_pairs(centroid, kNearCount, static_cast<float>(size_));
    Pairs apart;
    std::ranges::set_difference(near, edges, std::back_inserter(apart));
    merging.connect_in_sight(apart);
  }

  void start_round(int round, ClusterMerging& merging) {
    if (round >= kRoundsOfLength)
      set_largest(kLongest * size_ * std::exp2(round - kRoundsOfLength + 1));
    merging.set_limits(limits_);
    merging.queue_neighbours();
    const std::vector<std::uint32_t> alive = merging.alive();
    std::vector<Float3> centroid;
    for (const std::uint32_t c : alive) centroid.push_back(to_float3(merging[c].centroid()));
    Pairs pairs =
        find_near_pairs(centroid, kNearCount, static_cast<float>(size_ * std::exp2(round - 1)));
    for (auto& [a, b] : pairs) {
      a = alive[a];
      b = alive[b];
    }
    merging.connect_in_sight(pairs);
  }

  ElementPatches result(const ElementClusters& start, const ClusterMerging& merging) const {
    ElementPatches result;
    std::vector<std::uint32_t> current(start.cluster.size());
    for (std::uint32_t c = 0; c < current.size(); ++c) current[c] = merging.current(c);
    std::vector<std::uint32_t> patch_of(2 * current.size(), kNone);
    result.patch.reserve(start.of_element.size());
    for (const std::uint32_t c : start.of_element) {
      std::uint32_t& patch = patch_of[current[c]];
      if (patch == kNone) patch = static_cast<std::uint32_t>(result.patch_count++);
      result.patch.push_back(patch);
    }
    return result;
  }

  MergingScene scene_;
  const ClusterSettings& settings_;
  double size_;  ///< mean patch size, metres
  MergingLimits limits_{};
};

}  // namespace

ElementPatches merge_elements(const Elements& elements, const RayTracer& tracer,
                              const ClusterSettings& settings, const Progress& progress) {
  if (elements.size() == 0) return {};
  return ElementMerging(elements, tracer, settings).run(progress);
}

}  // namespace rebounce
