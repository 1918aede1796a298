#include "precompute/compression/light_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/base/blas.h"
#include "precompute/base/eigenvectors.h"
#include "precompute/base/parallel_loop.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Directions of a cluster that get a strength of their own.
constexpr Index kDirectionCount = 8;  // lab/034: more take more bytes for the same tail

// The variance of lights in any direction, as a fraction of the mean energy of the sample at one
// position (lab/044).
constexpr double kBackground = 1;

// The background grows with the square root of how far the energy of a patch is below the usual
// energy, so that the errors of all single patches count alike. It grows no further below this
// fraction of the usual energy (lab/044).
constexpr double kLeastEnergy = 1e-6;

struct Principal {
  MatrixXd directions;
  VectorXd energies;
};

/// The leading eigenvectors of sample sample^T and their eigenvalues.
Principal principal_directions(const MatrixXd& sample) {
  const bool tall = sample.rows() > sample.cols();
  const MatrixXd gram =
      tall ? MatrixXd(sample.transpose() * sample) : MatrixXd(sample * sample.transpose());
  const Eigenvectors found = eigenvectors(gram);
  const Index count = std::min(kDirectionCount, gram.rows());
  Principal result;
  result.energies = found.values.tail(count).cwiseMax(0);
  const auto vectors = found.vectors.rightCols(count);
  if (!tall) {
    result.directions = vectors;
    return result;
  }
  // Where there is no energy there is no direction, and none is needed.
  const VectorXd scale = result.energies.unaryExpr(
      [&](double e) { return e > 1e-12 * result.energies.maxCoeff() ? 1 / std::sqrt(e) : 0.0; });
  result.directions = sample * vectors * scale.asDiagonal();
  return result;
}

}  // namespace

void ClusterWeight::weigh_rows(Eigen::Ref<MatrixXd> matrix) const {
  matrix = background_.asDiagonal() * matrix;
  const MatrixXd part = strength_.asDiagonal() * (directions_.transpose() * matrix);
  matrix.noalias() += directions_ * part;
}

void ClusterWeight::weigh_columns(Eigen::Ref<MatrixXd> matrix) const {
  matrix = matrix * background_.asDiagonal();
  const MatrixXd part = (matrix * directions_) * strength_.asDiagonal();
  matrix.noalias() += part * directions_.transpose();
}

void ClusterWeight::send(Eigen::Ref<MatrixXd> lights) const {
  const MatrixXd part = strength_.asDiagonal() * (directions_.transpose() * lights);
  lights.noalias() += directions_ * part;
  lights = background_.asDiagonal() * lights;
}

double ClusterWeight::squared_norm() const {
  // The norm of B (I + P diag(s) P^T), with orthonormal P.
  double sum = background_.squaredNorm();
  for (Index k = 0; k < strength_.size(); ++k) {
    const double more = (1 + strength_[k]) * (1 + strength_[k]) - 1;
    sum += more * background_.cwiseProduct(directions_.col(k)).squaredNorm();
  }
  return sum;
}

void ClusterWeight::unweigh_rows(MatrixXd& basis) const {
  const VectorXd inverse = (strength_.array() / (1 + strength_.array())).matrix();
  const MatrixXd part = inverse.asDiagonal() * (directions_.transpose() * basis);
  basis.noalias() -= directions_ * part;
  basis = background_.cwiseInverse().asDiagonal() * basis;
}

VectorXd background_light(const SymmetricMatrix& matrix, const ClusterTree& tree) {
  const auto positions = static_cast<Index>(HierarchicalFormat::position_count(tree.patch.size()));
  VectorXd background = VectorXd::Ones(positions);
  const VectorXd of_patch = matrix.energies(tree.patch);
  std::vector<double> sorted;
  for (const std::uint32_t p : tree.patch) {
    if (matrix.roles().is_source(p)) sorted.push_back(of_patch[p]);
  }
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  const double usual = *middle;
  if (usual == 0) return background;
  VectorXd energy(of_patch.size());
  for (Index k = 0; k < energy.size(); ++k) {
    const std::uint32_t p = tree.patch[static_cast<std::size_t>(k)];
    energy[k] = matrix.roles().is_source(p) ? of_patch[p] : usual;
  }
  background.head(energy.size()) =
      (usual / energy.array().max(kLeastEnergy * usual).min(usual)).sqrt();
  return background;
}

std::vector<ClusterWeight> make_cluster_weights(std::span<const Cluster> clusters,
                                                const MatrixXd& sample, const VectorXd& background,
                                                const PatchRoles& roles) {
  const MatrixXd relative = background.cwiseInverse().asDiagonal() * sample;
  // The minimum keeps the variance positive where lights give no indirect light.
  const auto positions = static_cast<double>(
      roles.count(PatchRoles::kSource, static_cast<std::size_t>(relative.rows())));
  const double variance = std::max(kBackground * relative.squaredNorm() / positions,
                                   std::numeric_limits<double>::min());
  load_blas();
  std::vector<Principal> principal(clusters.size());
  parallel_loop(clusters.size(), [&](std::size_t k) {
    const Cluster& cluster = clusters[k];
    principal[k] = principal_directions(relative.middleRows(cluster.begin, cluster.count));
  });
  std::vector<ClusterWeight> weights;
  weights.reserve(principal.size());
  for (std::size_t k = 0; k < principal.size(); ++k) {
    VectorXd strength = (1 + principal[k].energies.array() / variance).sqrt() - 1;
    weights.emplace_back(background.segment(clusters[k].begin, clusters[k].count),
                         std::move(principal[k].directions), std::move(strength));
  }
  return weights;
}

}  // namespace rebounce
