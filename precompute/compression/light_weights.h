#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "precompute/patches/cluster_tree.h"

namespace rebounce {

/// The weight of a cluster, W = B (I + P diag(s) P^T): how strongly errors of the operator count,
/// by the light that the cluster gets. P holds the leading directions of the sample lights on the
/// cluster. The diagonal B stands for lights that the sample does not contain, above all single
/// patches that emit.
///
/// For lights x with E[x x^T] = v B (I + P diag(l) P^T) B, the mean square of |D x| is v |D W|² in
/// the Frobenius norm if 1 + s = sqrt(1 + l).
class ClusterWeight {
 public:
  /// `background` [positions], > 0, is the diagonal; `directions` [positions][k], orthonormal
  /// columns; `strength` [k], >= 0.
  ClusterWeight(Eigen::VectorXd background, Eigen::MatrixXd directions, Eigen::VectorXd strength)
      : background_(std::move(background)),
        directions_(std::move(directions)),
        strength_(std::move(strength)) {}

  /// matrix = W^T matrix.
  void weigh_rows(Eigen::Ref<Eigen::MatrixXd> matrix) const;

  /// matrix = matrix W.
  void weigh_columns(Eigen::Ref<Eigen::MatrixXd> matrix) const;

  /// lights = W lights.
  void send(Eigen::Ref<Eigen::MatrixXd> lights) const;

  /// The sum of the squares of the entries of W. Independent errors of equal size at all positions
  /// grow by this factor in squared norm under W^T, relative to the error at one position.
  double squared_norm() const;

  /// basis = W^-T basis.
  void unweigh_rows(Eigen::MatrixXd& basis) const;

 private:
  Eigen::VectorXd background_;
  Eigen::MatrixXd directions_;
  Eigen::VectorXd strength_;
};

/// The background B of lights that the sample does not contain, [positions]. It is 1 where the
/// light of a single patch reaches other patches as usual. It is more where less light arrives, so
/// that the error of such a patch counts like that of others. It is 1 for patches that are no
/// sources.
Eigen::VectorXd background_light(const SymmetricMatrix& matrix, const ClusterTree& tree);

/// The weights of some clusters of a tree. `sample` [positions][lights] holds a light in each
/// column, in the coordinates of Yhat, at sources only, scaled so that all lights count alike;
/// `background` comes from background_light.
std::vector<ClusterWeight> make_cluster_weights(std::span<const Cluster> clusters,
                                                const Eigen::MatrixXd& sample,
                                                const Eigen::VectorXd& background,
                                                const PatchRoles& roles = {});

}  // namespace rebounce
