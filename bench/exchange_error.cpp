#include "bench/exchange_error.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "precompute/patches/cluster_tree.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::bench {
namespace {

using Block = Eigen::MatrixXd;

// Patches in the smallest clusters whose blocks are looked at.
constexpr std::uint32_t kLeafSize = 32;

class FarBlocks {
 public:
  FarBlocks(const PatchModel& model, std::span<const std::vector<double>> matrices)
      : model_(model), matrices_(matrices), tree_(build_cluster_tree(model.patches, kLeafSize, 1)) {
    for (const Cluster& cluster : tree_.clusters) bounds_.push_back(bounds_of(cluster));
    result_.clear.mean_rank.resize(matrices.size());
    result_.mixed.mean_rank.resize(matrices.size());
  }

  FarRanksByVisibility run() {
    visit(0, 0);
    for (FarRanks* ranks : {&result_.clear, &result_.mixed}) {
      for (double& rank : ranks->mean_rank) {
        rank /= static_cast<double>(std::max<std::size_t>(ranks->block_count, 1));
      }
    }
    return result_;
  }

 private:
  struct Bounds {
    glm::dvec3 centre;
    double radius;
  };

  std::span<const std::uint32_t> patches(const Cluster& cluster) const {
    return std::span(tree_.patch).subspan(cluster.begin, cluster.count);
  }

  Bounds bounds_of(const Cluster& cluster) const {
    Bounds bounds{glm::dvec3(0), 0};
    for (const std::uint32_t p : patches(cluster)) {
      bounds.centre += to_dvec3(model_.patches.centroid[p]) / static_cast<double>(cluster.count);
    }
    for (const std::uint32_t p : patches(cluster)) {
      const double size = std::sqrt(model_.patches.area[p]);
      bounds.radius = std::max(
          bounds.radius, glm::distance(bounds.centre, to_dvec3(model_.patches.centroid[p])) + size);
    }
    return bounds;
  }

  bool is_far(std::uint32_t a, std::uint32_t b) const {
    const double gap =
        glm::distance(bounds_[a].centre, bounds_[b].centre) - bounds_[a].radius - bounds_[b].radius;
    return gap >= 2 * std::min(bounds_[a].radius, bounds_[b].radius);
  }

  void visit(std::uint32_t a, std::uint32_t b) {
    const Cluster &x = tree_.clusters[a], &y = tree_.clusters[b];
    if (a != b && is_far(a, b)) {
      add_block(patches(x), patches(y));
    } else if (!x.is_leaf() && (y.is_leaf() || x.count >= y.count)) {
      visit(x.first_child, b);
      visit(x.first_child + 1, b);
    } else if (!y.is_leaf()) {
      visit(a, y.first_child);
      visit(a, y.first_child + 1);
    }
  }

  Block block(std::span<const double> matrix, std::span<const std::uint32_t> rows,
              std::span<const std::uint32_t> columns) const {
    const std::size_t n = model_.patches.size();
    Block result(rows.size(), columns.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j) {
        const double areas =
            static_cast<double>(model_.patches.area[rows[i]]) * model_.patches.area[columns[j]];
        result(i, j) = matrix[rows[i] * n + columns[j]] / std::sqrt(areas);
      }
    }
    return result;
  }

  void add_block(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns) {
    std::vector<Block> blocks;
    double difference = 0;
    for (const std::vector<double>& matrix : matrices_) {
      blocks.push_back(block(matrix, rows, columns));
      difference = std::max(difference, (blocks.back() - blocks.front()).norm());
    }
    if (std::ranges::all_of(blocks, [](const Block& b) { return b.norm() == 0; })) return;
    const bool clear = difference <= 1e-3 * blocks.front().norm();
    FarRanks& ranks = clear ? result_.clear : result_.mixed;
    ++ranks.block_count;
    for (std::size_t m = 0; m < blocks.size(); ++m) ranks.mean_rank[m] += rank_of(blocks[m]);
  }

  static double rank_of(const Block& block) {
    const Eigen::VectorXd values = Eigen::BDCSVD<Block>(block).singularValues();
    const double most = std::pow(kRankTolerance, 2) * values.squaredNorm();
    Eigen::Index rank = values.size();
    double rest = 0;
    while (rank > 0 && rest + values[rank - 1] * values[rank - 1] <= most) {
      --rank;
      rest += values[rank] * values[rank];
    }
    return static_cast<double>(rank);
  }

  const PatchModel& model_;
  std::span<const std::vector<double>> matrices_;
  ClusterTree tree_;
  std::vector<Bounds> bounds_;
  FarRanksByVisibility result_;
};

}  // namespace

std::vector<double> dense_exchange(const ExchangeMatrix& exchange) {
  const std::size_t n = exchange.patch_count();
  std::vector<double> dense(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::size_t j = exchange.column[k];
      dense[i * n + j] = dense[j * n + i] = exchange.exchange_area[k];
    }
  }
  return dense;
}

std::vector<double> gather(std::span<const double> exchange, std::span<const float> area,
                           std::span<const double> radiosity) {
  const std::size_t n = area.size();
  std::vector<double> result(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) result[i] += exchange[i * n + j] * radiosity[j];
    result[i] /= area[i];
  }
  return result;
}

double light_error(std::span<const double> found, std::span<const double> truth,
                   std::span<const float> area) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    error += area[i] * std::pow(found[i] - truth[i], 2);
    norm += area[i] * truth[i] * truth[i];
  }
  return std::sqrt(error / norm);
}

double form_factor_error(std::span<const double> found, std::span<const double> truth,
                         std::span<const float> area) {
  const std::size_t n = area.size();
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const double areas = static_cast<double>(area[i]) * area[j];
      error += std::pow(found[i * n + j] - truth[i * n + j], 2) / areas;
      norm += std::pow(truth[i * n + j], 2) / areas;
    }
  }
  return std::sqrt(error / norm);
}

FarRanksByVisibility far_ranks(const PatchModel& model,
                               std::span<const std::vector<double>> matrices) {
  return FarBlocks(model, matrices).run();
}

}  // namespace rebounce::bench
