#include "precompute/patches/cluster_merging.h"

#include <algorithm>
#include <cmath>

#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// A difference of one in normal, reflectance or cover counts like a distance of this number of mean
// patch sizes (lab/025).
constexpr double kNormalWeight = 1.5, kReflectanceWeight = 1.0, kCoverWeight = 1.0;

// Pieces of the mesh up to this multiple of the largest length that may merge around itself are
// objects, larger ones walls.
constexpr double kSmallPiece = 4;

// Mergings between two calls of the watch.
constexpr std::size_t kWatchInterval = 1024;

/// The largest elements of both clusters, by area and then by number; the witnesses of each are in
/// this order.
void choose_witnesses(const Elements& elements, const ElementCluster& a, const ElementCluster& b,
                      ElementCluster& whole) {
  std::array<std::uint32_t, 2 * kWitnessCount> all{};
  const auto end = std::merge(
      a.witness.begin(), a.witness.begin() + a.witness_count, b.witness.begin(),
      b.witness.begin() + b.witness_count, all.begin(), [&](std::uint32_t x, std::uint32_t y) {
        return std::pair(-elements.area[x], x) < std::pair(-elements.area[y], y);
      });
  const auto count = std::min<std::size_t>(end - all.begin(), kWitnessCount);
  whole.witness_count = static_cast<std::uint8_t>(count);
  std::copy_n(all.begin(), count, whole.witness.begin());
}

/// The factor of the squared distance between the mean features of two clusters, m².
double joint_weight(const ElementCluster& a, const ElementCluster& b) {
  return a.area * b.area / (a.area + b.area);
}

}  // namespace

ElementCluster make_cluster(const Elements& elements, std::uint32_t e, double size) {
  ElementCluster cluster;
  cluster.surface = elements.area[e];
  cluster.area = cluster.surface * elements.density_weight[e];
  const Float3 centroid = elements.centroid(e);
  for (int k = 0; k < 3; ++k) {
    cluster.sum[k] = centroid[k];
    cluster.sum[3 + k] = kNormalWeight * size * elements.normal[e][k];
    cluster.sum[6 + k] = kReflectanceWeight * size * elements.reflectance[e][k];
  }
  cluster.sum[9] = kCoverWeight * size * elements.covered[e];
  cluster.sum[10] = size * elements.lamp_light[e];
  for (double& s : cluster.sum) s *= cluster.area;
  cluster.low = elements.low(e);
  cluster.high = elements.high(e);
  cluster.witness[0] = e;
  cluster.witness_count = 1;
  cluster.emits = elements.emits[e] != 0;
  return cluster;
}

ElementCluster join(const Elements& elements, const ElementCluster& a, const ElementCluster& b) {
  ElementCluster whole;
  whole.surface = a.surface + b.surface;
  whole.area = a.area + b.area;
  for (std::size_t k = 0; k < whole.sum.size(); ++k) whole.sum[k] = a.sum[k] + b.sum[k];
  whole.low = glm::min(a.low, b.low);
  whole.high = glm::max(a.high, b.high);
  whole.emits = a.emits;
  choose_witnesses(elements, a, b, whole);
  return whole;
}

double joint_length(const ElementCluster& a, const ElementCluster& b) {
  return glm::distance(glm::min(a.low, b.low), glm::max(a.high, b.high));
}

double merging_cost(const ElementCluster& a, const ElementCluster& b) {
  double distance_squared = 0;
  for (std::size_t k = 0; k < a.sum.size(); ++k) {
    const double d = a.sum[k] / a.area - b.sum[k] / b.area;
    distance_squared += d * d;
  }
  return joint_weight(a, b) * distance_squared;
}

ClusterMerging::ClusterMerging(const MergingScene& scene, std::vector<ElementCluster> clusters,
                               std::span<const std::uint32_t> number_of, std::uint32_t first)
    : scene_(scene),
      clusters_(std::move(clusters)),
      number_of_(number_of),
      first_(first),
      start_count_(static_cast<std::uint32_t>(clusters_.size())),
      merged_into_(clusters_.size(), kNone),
      neighbours_(clusters_.size()),
      alive_(clusters_.size()) {
  clusters_.reserve(2 * start_count_);
  merged_into_.reserve(2 * start_count_);
  neighbours_.reserve(2 * start_count_);
}

void ClusterMerging::queue(std::uint32_t a, std::uint32_t b) {
  const double cost = merging_cost(clusters_[a], clusters_[b]);
  if (cost <= limits_.cost) queue_.push({cost, a, b, false});
}

void ClusterMerging::connect(const Pairs& pairs) {
  for (const auto& [a, b] : pairs) {
    if (clusters_[a].emits != clusters_[b].emits) continue;
    neighbours_[a].push_back(b);
    neighbours_[b].push_back(a);
    queue(a, b);
  }
}

void ClusterMerging::connect_in_sight(const Pairs& pairs) {
  std::vector<std::uint8_t> joins(pairs.size());
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const ElementCluster &a = clusters_[pairs[k].first], &b = clusters_[pairs[k].second];
    if (merging_cost(a, b) > limits_.cost) continue;
    const bool may = joint_length(a, b) <= limits_.detail ||
                     std::min(a.area, b.area) <= limits_.fragment ||
                     is_in_sight(pairs[k].first, pairs[k].second);
    joins[k] = may ? 1 : 0;
  }
  Pairs joined;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (joins[k] != 0) joined.push_back(pairs[k]);
  }
  connect(joined);
}

void ClusterMerging::queue_neighbours() {
  for (const std::uint32_t c : alive()) {
    for (const std::uint32_t n : neighbours_[c]) {
      if (n > c && is_alive(n)) queue(c, n);
    }
  }
}

void ClusterMerging::merge_cheapest(std::size_t count, const Watch& watch) {
  while (alive_ > count && !queue_.empty()) {
    const Candidate pair = queue_.top();
    queue_.pop();
    if (!is_alive(pair.a) || !is_alive(pair.b)) continue;
    if (is_too_long(clusters_[pair.a], clusters_[pair.b])) continue;
    if (!pair.is_final) {
      const double more = cost_of_walls(pair.a, pair.b);
      if (more > 0) {
        if (pair.cost + more <= limits_.cost) queue_.push({pair.cost + more, pair.a, pair.b, true});
        continue;
      }
    }
    merge(pair);
    if (watch && alive_ % kWatchInterval == 0) watch(alive_);
  }
}

/// Clusters of low weight may be longer.
bool ClusterMerging::is_too_long(const ElementCluster& a, const ElementCluster& b) const {
  const double scale = std::sqrt((a.surface + b.surface) / (a.area + b.area));
  return joint_length(a, b) > limits_.largest * scale;
}

/// The cost that walls between two clusters add to merging_cost().
double ClusterMerging::cost_of_walls(std::uint32_t a, std::uint32_t b) const {
  const double sa = clusters_[a].surface, sb = clusters_[b].surface;
  return hidden_part(a, b) * limits_.wall * limits_.wall * sa * sb / (sa + sb);
}

/// The fraction of the lines of sight between two clusters that is blocked; 0 if most are free.
double ClusterMerging::hidden_part(std::uint32_t a, std::uint32_t b) const {
  const double length = joint_length(clusters_[a], clusters_[b]);
  if (length <= limits_.detail) return 0;
  const SightCount lines = look_between(a, b);
  const float piece = std::max(scene_.piece_length[clusters_[a].witness[0]],
                               scene_.piece_length[clusters_[b].witness[0]]);
  const bool may_hide_itself = length <= limits_.small && piece <= kSmallPiece * limits_.small;
  const std::size_t free = lines.free + (may_hide_itself ? lines.blocked_by_itself : 0);
  if (2 * free > lines.count) return 0;
  return 1 - static_cast<double>(free) / static_cast<double>(lines.count);
}

/// Tests the lines of sight between all witnesses of both clusters, until most are free.
ClusterMerging::SightCount ClusterMerging::look_between(std::uint32_t a, std::uint32_t b) const {
  const std::size_t to_count = clusters_[b].witness_count;
  SightCount lines{0, 0, clusters_[a].witness_count * to_count};
  std::array<Ray, 3 * kWitnessCount> rays;
  std::array<Hit, 3 * kWitnessCount> hits;
  for (std::size_t i = 0; i < clusters_[a].witness_count && 2 * lines.free <= lines.count; ++i) {
    for (std::size_t j = 0; j < to_count; ++j) {
      std::ranges::copy(line_of_sight(witness(a, i), witness(b, j), scene_.tracer), &rays[3 * j]);
    }
    scene_.tracer.intersect(std::span(rays).first(3 * to_count),
                            std::span(hits).first(3 * to_count));
    for (std::size_t j = 0; j < to_count; ++j) {
      const std::span<const Hit> line = std::span(hits).subspan(3 * j, 3);
      const auto hit = std::ranges::find_if(line, [](const Hit& h) { return h.triangle != kNone; });
      const Sight sight = hit == line.end() ? Sight::kFree : what_is_at(hit->triangle, a, b);
      lines.free += sight == Sight::kFree ? 1 : 0;
      lines.blocked_by_itself += sight == Sight::kItself ? 1 : 0;
    }
  }
  return lines;
}

bool ClusterMerging::is_in_sight(std::uint32_t a, std::uint32_t b) const {
  const std::uint32_t triangle = find_between(witness(a, 0), witness(b, 0), scene_.tracer);
  return triangle == kNone || what_is_at(triangle, a, b) == Sight::kFree;
}

/// The meaning of a triangle between the clusters a and b. Small objects hide nothing.
ClusterMerging::Sight ClusterMerging::what_is_at(std::uint32_t triangle, std::uint32_t a,
                                                 std::uint32_t b) const {
  if (triangle >= scene_.elements_of.size()) return Sight::kWall;
  bool small = true, lit = false;
  for (const std::uint32_t e : scene_.elements_of[triangle]) {
    if (e == kNone) continue;
    lit = true;
    const std::uint32_t start = number_of_[e] - first_;
    if (start < start_count_) {
      const std::uint32_t c = current(start);
      if (c == a || c == b) return Sight::kItself;
    }
    small &= scene_.piece_length[e] <= limits_.thing;
  }
  return small && lit ? Sight::kFree : Sight::kWall;
}

PatchPoint ClusterMerging::witness(std::uint32_t c, std::size_t k) const {
  const std::uint32_t e = clusters_[c].witness[k];
  return {scene_.elements.centroid(e), scene_.elements.normal[e]};
}

void ClusterMerging::merge(const Candidate& pair) {
  const auto merged = static_cast<std::uint32_t>(clusters_.size());
  clusters_.push_back(join(scene_.elements, clusters_[pair.a], clusters_[pair.b]));
  merged_into_[pair.a] = merged_into_[pair.b] = merged;
  merged_into_.push_back(kNone);
  --alive_;
  const auto cost = static_cast<float>(pair.cost);
  steps_.push_back({steps_.empty() ? cost : std::max(cost, steps_.back().height), pair.a, pair.b});
  if (clusters_.size() >= next_shortening_) {
    shorten_chains();
    next_shortening_ += clusters_.size() / 8;
  }
  std::vector<std::uint32_t> all;
  join_neighbours(pair.a, pair.b, all);
  for (const std::uint32_t n : all) {
    neighbours_[n].push_back(merged);
    queue(n, merged);
  }
  neighbours_.push_back(std::move(all));
}

/// Joins the neighbours of a and b that are still alive.
void ClusterMerging::join_neighbours(std::uint32_t a, std::uint32_t b,
                                     std::vector<std::uint32_t>& all) {
  for (const std::uint32_t part : {a, b}) {
    for (const std::uint32_t n : neighbours_[part]) {
      if (is_alive(n)) all.push_back(n);
    }
    std::vector<std::uint32_t>().swap(neighbours_[part]);
  }
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
}

std::vector<std::uint32_t> ClusterMerging::alive() const {
  std::vector<std::uint32_t> alive;
  alive.reserve(alive_);
  for (std::uint32_t c = 0; c < clusters_.size(); ++c) {
    if (is_alive(c)) alive.push_back(c);
  }
  return alive;
}

std::uint32_t ClusterMerging::current(std::uint32_t c) const {
  while (!is_alive(c)) c = merged_into_[c];
  return c;
}

/// Makes every cluster point to the cluster that it is part of, so that chains stay short.
void ClusterMerging::shorten_chains() {
  for (std::size_t c = clusters_.size(); c-- > 0;) {  // merged clusters come after their parts
    const std::uint32_t next = merged_into_[c];
    if (next != kNone && !is_alive(next)) merged_into_[c] = merged_into_[next];
  }
}

}  // namespace rebounce
