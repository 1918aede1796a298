#pragma once

// What links are made with from other links or from pairs of patches.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {

/// How the centroids of a node's patches are spread, by area.
struct NodeSpread {
  double area = 0;                                       ///< m²
  Eigen::Vector3d center = Eigen::Vector3d::Zero();      ///< area-weighted, metres
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m²
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();     ///< of it, without flat directions
};

/// The nodes of the tree that `links` have, [m]; `area` [n] in m², `centroid` [n] in metres.
std::vector<NodeSpread> spread_nodes(const FormFactorLinks& links, std::span<const float> area,
                                     std::span<const Float3> centroid);

/// A link as FormFactorLinks has it, in double precision.
struct AffineLink {
  std::uint32_t a = 0, b = 0;
  double exchange = 0;  ///< m²
  Eigen::Vector3d gradient_a = Eigen::Vector3d::Zero(), gradient_b = Eigen::Vector3d::Zero();
};

/// The square of the Frobenius norm of what `link` says of A^1/2 F A^-1/2.
double squared_norm(const AffineLink& link, const NodeSpread& a, const NodeSpread& b);

void append_link(const AffineLink& link, FormFactorLinks& links);

/// The link number `l` of `links`.
AffineLink affine_link(const FormFactorLinks& links, std::size_t l);

/// The sums of the rows of F as links have it [n].
std::vector<float> row_sums(const FormFactorLinks& links, std::span<const float> area,
                            std::span<const Float3> centroid);

/// Multiplies the scales of `links` until rows add up to `target` [n], nearly; no more than twice
/// or half. Where the target is 0 they become 0: what such a patch exchanges has leaked from others
/// of its nodes, of either sign.
void scale_rows(std::span<const float> target, std::span<const float> area,
                std::span<const Float3> centroid, FormFactorLinks& links);

}  // namespace rebounce
