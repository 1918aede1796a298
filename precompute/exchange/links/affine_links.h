#pragma once

// The mathematics of links that are made from other links or from pairs of patches.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/ranks.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {

/// The area-weighted distribution of the centroids of the patches of a node.
struct NodeSpread {
  double area = 0;                                       ///< m²
  Eigen::Vector3d center = Eigen::Vector3d::Zero();      ///< area-weighted, metres
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m²
  /// Of the covariance, without flat directions.
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
};

/// The spreads of the nodes of a tree, [m]; `area` [n] in m², `centroid` [n] in metres.
std::vector<NodeSpread> spread_nodes(const LinkedNodes& tree, std::span<const float> area,
                                     std::span<const Float3> centroid);

/// A link of FormFactorLinks in double precision.
struct AffineLink {
  std::uint32_t a = 0, b = 0;
  double exchange = 0;  ///< m²
  Eigen::Vector3d gradient_a = Eigen::Vector3d::Zero(), gradient_b = Eigen::Vector3d::Zero();
};

/// The squared Frobenius norm of the part of A^1/2 F A^-1/2 that `link` stands for.
double squared_norm(const AffineLink& link, const NodeSpread& a, const NodeSpread& b);

/// Gives all ranks the lists of links that each has made, list by list in turns.
void share(const Ranks& ranks, std::span<std::vector<AffineLink>> lists);

void append_link(const AffineLink& link, FormFactorLinks& links);

/// A link of the node `to`.
AffineLink affine_link(std::uint32_t to, const IncomingLink& link);

/// The row sums [n] of F given by links.
std::vector<float> row_sums(const LinkedFormFactors& links);

/// Multiplies the scales of `links` until rows nearly add up to `target` [n]; the factors stay in
/// [0.5, 2]. Where the target is 0 the scale becomes 0: the exchange of such a patch has leaked
/// from other patches of its nodes, with either sign.
void scale_rows(std::span<const float> target, std::span<const float> area,
                std::span<const Float3> centroid, FormFactorLinks& links);

}  // namespace rebounce
