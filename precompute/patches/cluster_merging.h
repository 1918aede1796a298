#pragma once

// Greedy merging of clusters of elements, the cheapest pair first.

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

/// Elements of a cluster between which lines of sight are drawn.
inline constexpr std::size_t kWitnessCount = 4;

/// Elements taken together.
struct Cluster {
  static constexpr std::size_t kFeatureCount = 10;

  double surface = 0;  ///< m²
  double area = 0;     ///< m², each element's times its density_weight
  std::array<double, kFeatureCount>
      sum{};                  ///< of area x feature: place, normal, reflectance, cover
  glm::vec3 low{0}, high{0};  ///< box around it, metres
  std::array<std::uint32_t, kWitnessCount> witness{};  ///< its largest elements
  std::uint8_t witness_count = 0;
  bool emits = false;

  glm::dvec3 centroid() const { return glm::dvec3(sum[0], sum[1], sum[2]) / area; }
};

/// A cluster of element `e` alone. A difference of one in normal, reflectance or cover weighs like
/// some patches of `size` metres of distance.
Cluster make_cluster(const Elements& elements, std::uint32_t e, double size);

/// Two clusters as one.
Cluster join(const Elements& elements, const Cluster& a, const Cluster& b);

/// Metres from corner to corner of the box around both.
double joint_length(const Cluster& a, const Cluster& b);

/// How much more the elements of both differ from their mean if they are one: J. H. Ward's
/// criterion, in m² of area x m² of distance between features.
double merging_cost(const Cluster& a, const Cluster& b);

/// What clusters may merge, and what it costs: see merge_elements(). Lengths are in metres.
struct MergingLimits {
  double detail;    ///< pairs that are no longer together merge through what stands between them
  double small;     ///< longer ones must not merge around themselves
  double largest;   ///< patch that may be made
  double thing;     ///< pieces of the mesh that are longer hide what is behind them
  double fragment;  ///< m²: a smaller cluster may join what it does not see
  double wall;      ///< what stands between a pair weighs like this distance
  double cost = std::numeric_limits<double>::infinity();  ///< the most that a merging may cost
};

/// What all merging of the elements of a scene shares.
struct MergingScene {
  const Elements& elements;
  const RayTracer& tracer;
  std::vector<std::array<std::uint32_t, 2>>
      elements_of;                  ///< [surface triangle, up to the last with any] or kNone
  std::vector<float> piece_length;  ///< metres: the connected piece of the mesh of each element
};

/// Clusters, which of them may become one, and the merging of these.
class ClusterMerging {
 public:
  /// A merging that was done: the result has the next number after all clusters before it.
  struct Step {
    float height;        ///< the most that a merging up to this one has cost
    std::uint32_t a, b;  ///< numbers of clusters
  };

  /// Called with the number of clusters left now and then.
  using Watch = std::function<void(std::size_t)>;

  /// `clusters` are all of which element `e` may be: it is in number_of[e] - first, where that is
  /// below their number.
  ClusterMerging(const MergingScene& scene, std::vector<Cluster> clusters,
                 std::span<const std::uint32_t> number_of, std::uint32_t first);

  void set_limits(const MergingLimits& limits) { limits_ = limits; }

  /// Makes neighbours of pairs of clusters, unless only one of them emits.
  void connect(const Pairs& pairs);

  /// The same for those that are detail, or one of them a fragment, or have nothing between them.
  void connect_in_sight(const Pairs& pairs);

  /// Gives neighbours that were refused another chance.
  void queue_neighbours();

  /// Merges neighbours, the cheapest first, until `count` clusters are left or none may merge.
  void merge_cheapest(std::size_t count, const Watch& watch = {});

  std::size_t alive_count() const { return alive_; }
  /// Numbers of the clusters that are left.
  std::vector<std::uint32_t> alive() const;
  const Cluster& operator[](std::uint32_t c) const { return clusters_[c]; }
  /// The cluster that has become of start cluster `c`.
  std::uint32_t current(std::uint32_t c) const;
  const std::vector<Step>& steps() const { return steps_; }

 private:
  struct Candidate {
    double cost;
    std::uint32_t a, b;
    bool is_final;                                  ///< what stands between is in the cost
    bool operator<(const Candidate& other) const {  // the cheapest is the greatest
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
  bool is_too_long(const Cluster& a, const Cluster& b) const;
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
  std::vector<Cluster> clusters_;
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
