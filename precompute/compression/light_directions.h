#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace rebounce {

/// Orthonormal directions of the light over a cell: some that are kept in any case, then those with
/// the most energy first.
struct LightDirections {
  Eigen::MatrixXd vectors;  ///< one to a column, [patches][patches]
  Eigen::VectorXd missing;  ///< [k] energy of a sample without the first k; [patches + 1]
  Eigen::Index kept = 0;    ///< the first ones

  /// The rank at which the missing energy and `worth` for each vector are together the least.
  Eigen::Index rank(double worth) const;
};

/// The directions of the samples `from`, after the orthonormal ones of `kept`, with the energies of
/// the samples `judges`. All are [patches][k].
LightDirections find_light_directions(const Eigen::MatrixXf& from, const Eigen::MatrixXf& judges,
                                      const Eigen::MatrixXd& kept);

/// The smallest ranks with which at most the `allowed` energy is missing, or as little as can be.
std::vector<Eigen::Index> ranks_within(std::span<const LightDirections> cells, double allowed);

}  // namespace rebounce
