#pragma once

#include <Eigen/Core>
#include <vector>

#include "cluster_tree.h"

namespace rebounce {

/// What light a cluster receives, as the weight W = I + P diag(s) P^T of errors in what the
/// operator does to it: P holds the leading directions of the sample lights on the cluster.
///
/// For lights x with E[x x^T] = v (I + P diag(l) P^T) the mean square of |D x| is v |D W|² in the
/// Frobenius norm when 1 + s = sqrt(1 + l). The identity stands for lights that the sample does not
/// show, single patches that emit first of all.
class ClusterWeight {
 public:
  /// `directions` [positions][k], orthonormal columns; `strength` [k], >= 0.
  ClusterWeight(Eigen::MatrixXd directions, Eigen::VectorXd strength)
      : directions_(std::move(directions)), strength_(std::move(strength)) {}

  /// matrix = W matrix.
  void put_left(Eigen::Ref<Eigen::MatrixXd> matrix) const;

  /// matrix = matrix W.
  void put_right(Eigen::Ref<Eigen::MatrixXd> matrix) const;

  /// basis = W^-1 basis.
  void take_away(Eigen::MatrixXd& basis) const;

 private:
  Eigen::MatrixXd directions_;
  Eigen::VectorXd strength_;
};

/// The weights of all clusters of `tree`. `sample` [positions][lights] holds a light in each
/// column, in the coordinates of Yhat, scaled so that all count alike.
std::vector<ClusterWeight> make_cluster_weights(const ClusterTree& tree,
                                                const Eigen::MatrixXd& sample);

}  // namespace rebounce
