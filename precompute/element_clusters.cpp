#include "rebounce/precompute/element_clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>

#include "element_neighbours.h"
#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

constexpr std::size_t kFeatureCount = 9;
using Feature = std::array<double, kFeatureCount>;

// A difference of one in normal or reflectance weighs like this many mean patch sizes of distance.
constexpr double kNormalWeight = 1.5, kReflectanceWeight = 1.0;

// Each element's nearest others that may join it without an edge between.
constexpr std::size_t kNearCount = 8;

// Where there are still too many patches, rounds in which those that lie near each other become
// neighbours and the leak test is left to larger ones; both lengths double each time.
constexpr int kRounds = 6;

// Elements of a patch between which lines of sight are drawn.
constexpr std::size_t kWitnessCount = 4;

// What is no longer than this part of the mean size hides nothing, and may merge around itself.
constexpr double kSmall = 0.5;

// Only pieces of the mesh up to this many times that length are things and not walls.
constexpr double kSmallPiece = 4;

struct Cluster {
  double area = 0;
  Feature sum{};  ///< of area x feature
  glm::dvec3 low{0}, high{0};
  std::array<std::uint32_t, kWitnessCount> witness{};  ///< its largest elements
  std::size_t witness_count = 0;
  std::vector<std::uint32_t> neighbours;
  bool emits = false;
  std::uint32_t merged_into = kNone;
};

struct Candidate {
  double cost;
  std::uint32_t a, b;
  bool operator<(const Candidate& other) const {  // the cheapest is the greatest
    if (cost != other.cost) return cost > other.cost;
    return std::pair(a, b) > std::pair(other.a, other.b);
  }
};

class Merging {
 public:
  Merging(const Elements& elements, const RayTracer& tracer, const ClusterSettings& settings)
      : elements_(elements), tracer_(tracer), settings_(settings), alive_(elements.size()) {
    const double area = std::accumulate(elements.area.begin(), elements.area.end(), 0.0);
    size_ = settings.patch_count > 0 ? std::sqrt(area / static_cast<double>(settings.patch_count))
                                     : settings.largest;
    small_ = kSmall * size_;
    clusters_.reserve(2 * elements.size());
    elements_of_.assign(1 + *std::ranges::max_element(elements.triangle), {kNone, kNone});
    for (std::uint32_t e = 0; e < elements.size(); ++e) {
      clusters_.push_back(cluster_of(e));
      auto& sides = elements_of_[elements.triangle[e]];
      sides[sides[0] == kNone ? 0 : 1] = e;
    }
  }

  ElementPatches run() {
    const Pairs edges = find_edge_neighbours(elements_.corner);
    measure_pieces(edges);
    connect(edges);
    connect_in_sight(find_near_pairs(elements_.centroid, kNearCount, static_cast<float>(size_)));
    merge_cheapest();
    for (int round = 0; round < kRounds && alive_ > settings_.patch_count; ++round) {
      small_ *= 2;
      queue_neighbours();
      connect_near_clusters(size_ * std::exp2(round));
      merge_cheapest();
    }
    return result();
  }

 private:
  Cluster cluster_of(std::uint32_t e) const {
    Cluster cluster;
    cluster.area = elements_.area[e];
    for (int k = 0; k < 3; ++k) {
      cluster.sum[k] = elements_.centroid[e][k];
      cluster.sum[3 + k] = kNormalWeight * size_ * elements_.normal[e][k];
      cluster.sum[6 + k] = kReflectanceWeight * size_ * elements_.reflectance[e][k];
    }
    for (double& s : cluster.sum) s *= cluster.area;
    cluster.low = to_dvec3(elements_.low[e]);
    cluster.high = to_dvec3(elements_.high[e]);
    cluster.witness[0] = e;
    cluster.witness_count = 1;
    cluster.emits = elements_.emits[e] != 0;
    return cluster;
  }

  /// Finds how long the connected piece of the mesh is that each element is of.
  void measure_pieces(const Pairs& edges) {
    std::vector<std::uint32_t> piece(elements_.size());
    std::iota(piece.begin(), piece.end(), 0U);
    const auto find = [&](std::uint32_t e) {
      while (piece[e] != e) e = piece[e] = piece[piece[e]];
      return e;
    };
    for (const auto& [a, b] : edges) {
      const std::uint32_t low = std::min(find(a), find(b)), high = std::max(find(a), find(b));
      piece[high] = low;
    }
    std::vector<glm::dvec3> low(elements_.size(), glm::dvec3(std::numeric_limits<double>::max()));
    std::vector<glm::dvec3> high(elements_.size(), -low[0]);
    for (std::uint32_t e = 0; e < elements_.size(); ++e) {
      low[find(e)] = glm::min(low[find(e)], to_dvec3(elements_.low[e]));
      high[find(e)] = glm::max(high[find(e)], to_dvec3(elements_.high[e]));
    }
    for (std::uint32_t e = 0; e < elements_.size(); ++e) {
      piece_length_.push_back(glm::distance(low[find(e)], high[find(e)]));
    }
  }

  static double cost(const Cluster& a, const Cluster& b) {
    double distance_squared = 0;
    for (std::size_t k = 0; k < kFeatureCount; ++k) {
      const double d = a.sum[k] / a.area - b.sum[k] / b.area;
      distance_squared += d * d;
    }
    return a.area * b.area / (a.area + b.area) * distance_squared;
  }

  void connect(const Pairs& pairs) {
    for (const auto& [a, b] : pairs) {
      if (clusters_[a].emits != clusters_[b].emits) continue;
      clusters_[a].neighbours.push_back(b);
      clusters_[b].neighbours.push_back(a);
      queue_.push({cost(clusters_[a], clusters_[b]), a, b});
    }
  }

  /// Connects those of the pairs of clusters that nothing large stands between.
  void connect_in_sight(const Pairs& pairs) {
    std::vector<std::uint8_t> in_sight(pairs.size());
#pragma omp parallel for schedule(dynamic, 256)
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const auto [a, b] = pairs[k];
      in_sight[k] = look_between(a, b, witness(a, 0), witness(b, 0)) == Sight::kFree ? 1 : 0;
    }
    Pairs seen;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (in_sight[k] != 0) seen.push_back(pairs[k]);
    }
    connect(seen);
  }

  /// Gives pairs that were refused another chance.
  void queue_neighbours() {
    for (std::uint32_t c = 0; c < clusters_.size(); ++c) {
      if (!is_alive(c)) continue;
      for (const std::uint32_t n : clusters_[c].neighbours) {
        if (n > c && is_alive(n)) queue_.push({cost(clusters_[c], clusters_[n]), c, n});
      }
    }
  }

  void connect_near_clusters(double reach) {
    std::vector<std::uint32_t> cluster;
    std::vector<Float3> centroid;
    for (std::uint32_t c = 0; c < clusters_.size(); ++c) {
      if (!is_alive(c)) continue;
      cluster.push_back(c);
      const Cluster& of = clusters_[c];
      centroid.push_back(to_float3(glm::dvec3(of.sum[0], of.sum[1], of.sum[2]) / of.area));
    }
    Pairs pairs = find_near_pairs(centroid, kNearCount, static_cast<float>(reach));
    for (auto& [a, b] : pairs) {
      a = cluster[a];
      b = cluster[b];
    }
    connect_in_sight(pairs);
  }

  void merge_cheapest() {
    while (alive_ > settings_.patch_count && !queue_.empty()) {
      const Candidate pair = queue_.top();
      queue_.pop();
      if (is_alive(pair.a) && is_alive(pair.b) && may_merge(pair.a, pair.b)) merge(pair.a, pair.b);
    }
  }

  bool is_alive(std::size_t c) const {
    return clusters_[c].merged_into == kNone;
  }

  bool may_merge(std::uint32_t a, std::uint32_t b) const {
    const double length = glm::distance(glm::min(clusters_[a].low, clusters_[b].low),
                                        glm::max(clusters_[a].high, clusters_[b].high));
    if (settings_.largest > 0 && length > settings_.largest) return false;
    const auto [free, blocked_by_itself, count] = look_between(a, b);
    if (2 * free > count) return true;
    const double piece =
        std::max(piece_length_[clusters_[a].witness[0]], piece_length_[clusters_[b].witness[0]]);
    return 2 * (free + blocked_by_itself) > count && length <= small_ &&
           piece <= kSmallPiece * small_;
  }

  enum class Sight : std::uint8_t { kFree, kItself, kWall };

  /// What stands between two points of clusters a and b. What is small hides nothing.
  Sight look_between(std::uint32_t a, std::uint32_t b, const PatchPoint& from,
                     const PatchPoint& to) const {
    const std::uint32_t triangle = find_between(from, to, tracer_);
    if (triangle == kNone) return Sight::kFree;
    bool small = true;
    for (const std::uint32_t e : elements_of_[triangle]) {
      if (e == kNone) continue;
      const std::uint32_t c = cluster_of_element(e);
      if (c == a || c == b) return Sight::kItself;
      small &= piece_length_[e] <= kSmall * size_;
    }
    const bool unlit = elements_of_[triangle] == std::array{kNone, kNone};
    return small && !unlit ? Sight::kFree : Sight::kWall;
  }

  struct SightCount {
    std::size_t free, blocked_by_itself, count;
  };

  SightCount look_between(std::uint32_t a, std::uint32_t b) const {
    SightCount result{0, 0, clusters_[a].witness_count * clusters_[b].witness_count};
    for (std::size_t i = 0; i < clusters_[a].witness_count; ++i) {
      for (std::size_t j = 0; j < clusters_[b].witness_count; ++j) {
        const Sight sight = look_between(a, b, witness(a, i), witness(b, j));
        result.free += sight == Sight::kFree ? 1 : 0;
        result.blocked_by_itself += sight == Sight::kItself ? 1 : 0;
      }
    }
    return result;
  }

  std::uint32_t cluster_of_element(std::uint32_t e) const {
    std::uint32_t c = e;
    while (!is_alive(c)) c = clusters_[c].merged_into;
    return c;
  }

  /// Lets every cluster point to the one that it is part of now, so that chains stay short.
  void shorten_chains() {
    for (std::size_t c = clusters_.size(); c-- > 0;) {  // what merged comes after its parts
      const std::uint32_t next = clusters_[c].merged_into;
      if (next != kNone && !is_alive(next)) clusters_[c].merged_into = clusters_[next].merged_into;
    }
  }

  PatchPoint witness(std::uint32_t cluster, std::size_t k) const {
    const std::uint32_t e = clusters_[cluster].witness[k];
    return {elements_.centroid[e], elements_.normal[e]};
  }

  void merge(std::uint32_t a, std::uint32_t b) {
    const auto merged = static_cast<std::uint32_t>(clusters_.size());
    Cluster& whole = clusters_.emplace_back();
    Cluster &first = clusters_[a], &second = clusters_[b];
    whole.area = first.area + second.area;
    for (std::size_t k = 0; k < kFeatureCount; ++k) whole.sum[k] = first.sum[k] + second.sum[k];
    whole.low = glm::min(first.low, second.low);
    whole.high = glm::max(first.high, second.high);
    whole.emits = first.emits;
    choose_witnesses(first, second, whole);
    first.merged_into = second.merged_into = merged;
    --alive_;
    if (clusters_.size() >= next_shortening_) {
      shorten_chains();
      next_shortening_ += clusters_.size() / 8;
    }
    join_neighbours(first, second, whole);
    for (const std::uint32_t n : whole.neighbours) {
      clusters_[n].neighbours.push_back(merged);
      queue_.push({cost(whole, clusters_[n]), n, merged});
    }
  }

  void choose_witnesses(const Cluster& a, const Cluster& b, Cluster& whole) const {
    std::vector<std::uint32_t> all(a.witness.begin(), a.witness.begin() + a.witness_count);
    all.insert(all.end(), b.witness.begin(), b.witness.begin() + b.witness_count);
    std::ranges::sort(all, [&](std::uint32_t x, std::uint32_t y) {
      return std::pair(-elements_.area[x], x) < std::pair(-elements_.area[y], y);
    });
    whole.witness_count = std::min(all.size(), kWitnessCount);
    std::copy_n(all.begin(), whole.witness_count, whole.witness.begin());
  }

  void join_neighbours(Cluster& a, Cluster& b, Cluster& whole) {
    std::vector<std::uint32_t>& all = whole.neighbours;
    for (Cluster* part : {&a, &b}) {
      for (const std::uint32_t n : part->neighbours) {
        if (is_alive(n)) all.push_back(n);
      }
      std::vector<std::uint32_t>().swap(part->neighbours);
    }
    std::ranges::sort(all);
    all.erase(std::ranges::unique(all).begin(), all.end());
  }

  ElementPatches result() {
    shorten_chains();
    ElementPatches result;
    std::vector<std::uint32_t> patch_of(clusters_.size(), kNone);
    for (std::uint32_t e = 0; e < elements_.size(); ++e) {
      std::uint32_t& patch = patch_of[cluster_of_element(e)];
      if (patch == kNone) patch = static_cast<std::uint32_t>(result.patch_count++);
      result.patch.push_back(patch);
    }
    return result;
  }

  const Elements& elements_;
  const RayTracer& tracer_;
  const ClusterSettings& settings_;
  double size_;   ///< the mean patch's, metres
  double small_;  ///< what is no longer may merge around itself, metres
  std::size_t alive_;
  std::vector<std::array<std::uint32_t, 2>> elements_of_;  ///< sides of each surface triangle
  std::vector<double> piece_length_;                       ///< metres, by element
  std::vector<Cluster> clusters_;
  std::size_t next_shortening_ = 0;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

void Elements::resize(std::size_t count) {
  triangle.resize(count);
  corner.resize(count);
  centroid.resize(count);
  low.resize(count);
  high.resize(count);
  normal.resize(count);
  area.resize(count);
  reflectance.resize(count);
  emits.resize(count);
}

ElementPatches merge_elements(const Elements& elements, const RayTracer& tracer,
                              const ClusterSettings& settings) {
  if (elements.size() == 0) return {};
  return Merging(elements, tracer, settings).run();
}

}  // namespace rebounce
