#pragma once

// Greedy merging of clusters of elements, the pair of least cost first.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <queue>
#include <span>
#include <vector>

#include "precompute/patches/element_neighbours.h"
#include "precompute/patches/elements.h"

namespace rebounce {

/// Elements of a cluster that lines of sight are drawn between.
inline constexpr std::size_t kWitnessCount = 4;

/// A set of elements.
struct ElementCluster {
  static constexpr std::size_t kFeatureCount = 11;

  double surface = 0;  ///< m²
  double area = 0;     ///< m², areas times density_weight, summed over the elements
  std::array<double, kFeatureCount>
      sum{};  ///< of area x feature: position, normal, reflectance, cover, light of lamps
  glm::vec3 low{0}, high{0};                           ///< box around the cluster, metres
  std::array<std::uint32_t, kWitnessCount> witness{};  ///< its largest elements
  std::uint8_t witness_count = 0;
  bool emits = false;

  glm::dvec3 centroid() const { return glm::dvec3(sum[0], sum[1], sum[2]) / area; }
};

/// A cluster of element `e` alone. A difference of one in normal, reflectance or cover counts like
/// a distance of some patches of `size` metres.
ElementCluster make_cluster(const Elements& elements, std::uint32_t e, double size);

/// The union of two clusters.
ElementCluster join(const Elements& elements, const ElementCluster& a, const ElementCluster& b);

/// Length of the diagonal of the box around both, metres.
double joint_length(const ElementCluster& a, const ElementCluster& b);

/// The increase of the squared deviation of the elements from their mean if the two are merged: J.
/// H. Ward's criterion, in m² of area x m² of distance between features.
double merging_cost(const ElementCluster& a, const ElementCluster& b);

/// Which clusters may merge, and at what cost: see merge_elements(). Lengths are in metres.
struct MergingLimits {
  double detail;    ///< longest pair that may merge through obstacles
  double small;     ///< longest pair that may merge around itself
  double largest;   ///< longest patch
  double thing;     ///< longest piece of the mesh that hides nothing
  double fragment;  ///< m²: a smaller cluster may join clusters that it does not see
  double wall;      ///< an obstacle between a pair counts like this distance
  double cost = std::numeric_limits<double>::infinity();  ///< limit of the cost of a merging
};

/// What all mergings of the elements of a scene share.
struct MergingScene {
  const Elements& elements;
  const RayTracer& tracer;
  std::vector<std::array<std::uint32_t, 2>>
      elements_of;  ///< [surface triangle, up to the last with an element], kNone without one
  /// Metres: length of the connected piece of the mesh of each element.
  std::vector<float> piece_length;
};

/// A set of clusters, the pairs of neighbours among them that may merge, and their merging.
class ClusterMerging {
 public:
  /// A merging: its result has the next free cluster number.
  struct Step {
    float height;        ///< largest cost of a merging up to this one
    std::uint32_t a, b;  ///< numbers of clusters
  };

  /// Called from time to time with the number of clusters that are left.
  using Watch = std::function<void(std::size_t)>;

  /// `clusters` contain every element: element `e` is in cluster number_of[e] - first, if that is
  /// below the number of clusters.
  ClusterMerging(const MergingScene& scene, std::vector<ElementCluster> clusters,
                 std::span<const std::uint32_t> number_of, std::uint32_t first);

  void set_limits(const MergingLimits& limits) { limits_ = limits; }

  /// Makes pairs of clusters neighbours, unless only one of the two emits.
  void connect(const Pairs& pairs);

  /// The same for pairs that are short, have a fragment in them, or have nothing between them.
  void connect_in_sight(const Pairs& pairs);

  /// Offers refused pairs of neighbours again.
  void queue_neighbours();

  /// Merges neighbours, the pair of least cost first, until `count` clusters are left or no pair
  /// may merge.
  void merge_cheapest(std::size_t count, const Watch& watch = {});

  std::size_t alive_count() const { return alive_; }
  /// The numbers of the clusters that are left.
  std::vector<std::uint32_t> alive() const;
  const ElementCluster& operator[](std::uint32_t c) const { return clusters_[c]; }
  /// The cluster that contains the start cluster `c`.
  std::uint32_t current(std::uint32_t c) const;
  const std::vector<Step>& steps() const { return steps_; }

 private:
  struct Candidate {
    double cost;
    std::uint32_t a, b;
    bool is_final;  ///< the cost includes obstacles between the pair
    // The queue returns the greatest: the one of least cost.
    bool operator<(const Candidate& other) const {
      if (cost != other.cost) return cost > other.cost;
      return std::pair(a, b) > std::pair(other.a, other.b);
    }
  };

  enum class Sight : std::uint8_t { kFree, kItself, kWall };

  struct SightCount {
    std::size_t free, blocked_by_itself, count;
  };

  void queue(std::uint32_t a, std::uint32_t b);
  bool is_alive(std::uint32_t c) const { return merged_into_[c] == kNone; }
  bool is_too_long(const ElementCluster& a, const ElementCluster& b) const;
  double cost_of_walls(std::uint32_t a, std::uint32_t b) const;
  double hidden_part(std::uint32_t a, std::uint32_t b) const;
  SightCount look_between(std::uint32_t a, std::uint32_t b) const;
  bool is_in_sight(std::uint32_t a, std::uint32_t b) const;
  Sight what_is_at(std::uint32_t triangle, std::uint32_t a, std::uint32_t b) const;
  PatchPoint witness(std::uint32_t c, std::size_t k) const;
  void merge(const Candidate& pair);
  void join_neighbours(std::uint32_t a, std::uint32_t b, std::vector<std::uint32_t>& all);
  void shorten_chains();

  const MergingScene& scene_;
  std::vector<ElementCluster> clusters_;
  std::span<const std::uint32_t> number_of_;
  std::uint32_t first_, start_count_;
  std::vector<std::uint32_t> merged_into_;              ///< or kNone
  std::vector<std::vector<std::uint32_t>> neighbours_;  ///< of each cluster
  MergingLimits limits_{};
  std::size_t alive_, next_shortening_ = 0;
  std::priority_queue<Candidate> queue_;
  std::vector<Step> steps_;
};

}  // namespace rebounce
