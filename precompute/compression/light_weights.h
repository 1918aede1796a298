#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "precompute/patches/cluster_tree.h"

namespace rebounce {

/// What light a cluster receives, as the weight W = B (I + P diag(s) P^T) of errors in what the
/// operator does to it: P holds the leading directions of the sample lights on the cluster, and the
/// diagonal B stands for lights that the sample does not show, single patches that emit first of
/// all.
///
/// For lights x with E[x x^T] = v B (I + P diag(l) P^T) B the mean square of |D x| is v |D W|² in
/// the Frobenius norm when 1 + s = sqrt(1 + l).
class ClusterWeight {
 public:
  /// `background` [positions], > 0, is the diagonal; `directions` [positions][k], orthonormal
  /// columns; `strength` [k], >= 0.
  ClusterWeight(Eigen::VectorXd background, Eigen::MatrixXd directions, Eigen::VectorXd strength)
      : background_(std::move(background)),
        directions_(std::move(directions)),
        strength_(std::move(strength)) {}

  /// matrix = W^T matrix.
  void put_left(Eigen::Ref<Eigen::MatrixXd> matrix) const;

  /// matrix = matrix W.
  void put_right(Eigen::Ref<Eigen::MatrixXd> matrix) const;

  /// Sum of the squares of the entries of W: by it the squared norm of what W^T makes of errors
  /// that are as large at all positions, and independent, is larger than theirs at one.
  double squared_norm() const;

  /// basis = W^-T basis.
  void take_away(Eigen::MatrixXd& basis) const;

 private:
  Eigen::VectorXd background_;
  Eigen::MatrixXd directions_;
  Eigen::VectorXd strength_;
};

/// How strong lights are that the sample does not show, [positions]: 1 where the light of a single
/// patch reaches others as it usually does, and more where less of it arrives, so that its error
/// counts beside what does; 1 where no light comes from, as patches are no sources.
Eigen::VectorXd background_light(const SymmetricMatrix& matrix, const ClusterTree& tree);

/// The weights of all clusters of `tree`. `sample` [positions][lights] holds a light in each
/// column, in the coordinates of Yhat, of sources alone, scaled so that all count alike;
/// `background` is as background_light gives it.
std::vector<ClusterWeight> make_cluster_weights(const ClusterTree& tree,
                                                const Eigen::MatrixXd& sample,
                                                const Eigen::VectorXd& background,
                                                const PatchRoles& roles = {});

}  // namespace rebounce
