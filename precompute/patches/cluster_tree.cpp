#include "precompute/patches/cluster_tree.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>
#include <span>

namespace rebounce {
namespace {

using Feature = Eigen::Matrix<double, 6, 1>;

// Opposite normals count like a distance of this fraction of the size of the scene (lab/050).
constexpr double kTreeNormalWeight = 0.25;

/// Positions in units of the size of the scene, and weighted normals.
std::vector<Feature> make_features(const PatchTable& patches) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max()), high = -low;
  for (const Float3& p : patches.centroid) {
    const Eigen::Vector3d point(p[0], p[1], p[2]);
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const double size = std::max((high - low).norm(), std::numeric_limits<double>::min());
  std::vector<Feature> features(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      features[i][k] = (patches.centroid[i][k] - low[k]) / size;
      features[i][3 + k] = 0.5 * kTreeNormalWeight * patches.normal[i][k];
    }
  }
  return features;
}

class TreeBuilder {
 public:
  TreeBuilder(const PatchTable& patches, std::uint32_t leaf_size, std::uint32_t alignment,
              std::span<const std::uint8_t> group)
      : features_(make_features(patches)),
        group_(group),
        leaf_size_(leaf_size),
        alignment_(alignment) {
    tree_.patch.resize(patches.size());
    std::iota(tree_.patch.begin(), tree_.patch.end(), 0U);
    projection_.resize(patches.size());
    tree_.clusters.push_back({0, aligned(static_cast<std::uint32_t>(patches.size()))});
    for (std::size_t k = 0; k < tree_.clusters.size(); ++k) split(k);
  }

  ClusterTree take() { return std::move(tree_); }

 private:
  std::uint32_t aligned(std::uint32_t count) const {
    return (count + alignment_ - 1) / alignment_ * alignment_;
  }

  void split(std::size_t index) {
    const Cluster cluster = tree_.clusters[index];
    if (cluster.count <= leaf_size_) return;
    const std::size_t end =
        std::min<std::size_t>(cluster.begin + cluster.count, tree_.patch.size());
    const std::span<std::uint32_t> members(tree_.patch.data() + cluster.begin,
                                           tree_.patch.data() + end);
    std::uint32_t first = part_groups(members, cluster.count);
    if (first == 0) {
      sort_along_axis(members);
      first = best_split(members, cluster.count);
    }
    tree_.clusters[index].first_child = static_cast<std::uint32_t>(tree_.clusters.size());
    tree_.clusters.push_back({cluster.begin, first});
    tree_.clusters.push_back({cluster.begin + first, cluster.count - first});
  }

  /// Sorts the patches by group. Returns the size of a first child that ends at the boundary of a
  /// group, the one nearest to the middle; 0 if there is only one group or all are in the same run
  /// of the alignment.
  std::uint32_t part_groups(std::span<std::uint32_t> members, std::uint32_t count) const {
    if (group_.empty()) return 0;
    std::ranges::sort(members, [&](std::uint32_t a, std::uint32_t b) {
      return group_[a] != group_[b] ? group_[a] < group_[b] : a < b;
    });
    const auto off_middle = [&](std::uint32_t first) {
      return 2 * first > count ? 2 * first - count : count - 2 * first;
    };
    std::uint32_t best = 0;
    for (std::uint32_t k = 1; k < members.size(); ++k) {
      if (group_[members[k - 1]] == group_[members[k]]) continue;
      // The run that both groups share begins the second child, and is the first run of it.
      const std::uint32_t first = std::max(k / alignment_ * alignment_, alignment_);
      if (first < count && (best == 0 || off_middle(first) < off_middle(best))) best = first;
    }
    return best;
  }

  void sort_along_axis(std::span<std::uint32_t> members) {
    Feature mean = Feature::Zero();
    for (const std::uint32_t p : members) mean += features_[p];
    mean /= static_cast<double>(members.size());
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    for (const std::uint32_t p : members) {
      const Feature d = features_[p] - mean;
      covariance += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(covariance);
    const Feature axis = solver.eigenvectors().col(5);
    for (const std::uint32_t p : members) projection_[p] = axis.dot(features_[p]);
    std::ranges::sort(members, [&](std::uint32_t a, std::uint32_t b) {
      return projection_[a] != projection_[b] ? projection_[a] < projection_[b] : a < b;
    });
  }

  /// The size of the first child, in the middle half, that leaves the least variance along the
  /// axis.
  std::uint32_t best_split(std::span<const std::uint32_t> members, std::uint32_t count) const {
    std::vector<double> sum(members.size() + 1, 0.0);
    for (std::size_t k = 0; k < members.size(); ++k) sum[k + 1] = sum[k] + projection_[members[k]];
    const auto size = static_cast<double>(members.size());
    const std::uint32_t half = aligned(count / 2);
    std::uint32_t best = half;
    double best_gain = -1;
    for (std::uint32_t first = alignment_; first < members.size(); first += alignment_) {
      if (4 * first < count || 4 * first > 3 * count) continue;
      const double difference = sum[first] / first - (sum.back() - sum[first]) / (size - first);
      const double gain = first * (size - first) * difference * difference;
      if (gain > best_gain) {
        best_gain = gain;
        best = first;
      }
    }
    return best;
  }

  std::vector<Feature> features_;
  std::span<const std::uint8_t> group_;
  std::uint32_t leaf_size_, alignment_;
  ClusterTree tree_;
  std::vector<double> projection_;  ///< of each patch on the axis of the cluster that is split
};

}  // namespace

ClusterTree build_cluster_tree(const PatchTable& patches, std::uint32_t leaf_size,
                               std::uint32_t alignment, std::span<const std::uint8_t> group) {
  return TreeBuilder(patches, leaf_size, alignment, group).take();
}

std::vector<std::uint32_t> clusters_up_to(const ClusterTree& tree, std::uint32_t most) {
  std::vector<std::uint32_t> chosen, left{0};
  while (!left.empty()) {
    const std::uint32_t index = left.back();
    left.pop_back();
    const Cluster& cluster = tree.clusters[index];
    if (cluster.count <= most || cluster.is_leaf()) {
      chosen.push_back(index);
    } else {
      left.push_back(cluster.first_child + 1);
      left.push_back(cluster.first_child);
    }
  }
  return chosen;
}

std::span<const std::uint32_t> patches_of(const ClusterTree& tree, const Cluster& cluster) {
  const std::size_t end = std::min<std::size_t>(cluster.begin + cluster.count, tree.patch.size());
  return {tree.patch.data() + cluster.begin, tree.patch.data() + end};
}

}  // namespace rebounce
