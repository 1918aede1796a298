#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce {

/// The exchange of two nodes with nothing between them, estimated from the kernel between their
/// cells, and its distance from an affine kernel.
class PairKernel {
 public:
  PairKernel(const LinkTree& tree, const ShadowRays& shadow_rays)
      : tree_(tree), shadow_rays_(shadow_rays) {}

  /// Estimates the pair (a, b). Returns false if cells are too near each other; the results are
  /// then undefined.
  bool estimate(std::uint32_t a, std::uint32_t b);

  double unoccluded() const { return unoccluded_; }  ///< exchange area, m²
  /// Of the exchange area, m; see Link.
  const glm::dvec3& gradient_a() const { return gradient_a_; }
  const glm::dvec3& gradient_b() const { return gradient_b_; }

  /// The integral over both nodes of (kernel - affine approximation)², without dimension.
  double residual_squared() const { return residual_squared_; }

  /// True if some cells face each other and some do not: a link would leak light to surfaces
  /// behind.
  bool faces_in_part() const { return faces_in_part_; }

  /// The integral of kernel² over both nodes, without dimension.
  double norm_squared() const { return norm_squared_; }

 private:
  using Cells = std::span<const std::uint32_t>;

  bool fill(Cells cells_a, Cells cells_b);
  bool fill(const LinkNode& p, const LinkNode& q, double& kernel);
  double exchange_of_patches(const LinkNode& p, const LinkNode& q) const;
  void fit(const LinkNode& a, Cells cells_a, const LinkNode& b, Cells cells_b);
  void limit(const LinkNode& a, Cells cells_a, const LinkNode& b, Cells cells_b);
  double fall(const LinkNode& node, Cells cells, const glm::dvec3& gradient) const;
  void measure(const LinkNode& a, Cells cells_a, const LinkNode& b, Cells cells_b);

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  std::array<double, LinkTree::kCellCount * LinkTree::kCellCount> kernel_;  ///< of cells, 1/m²
  bool faces_in_part_ = false;
  double uncertain_ = 0;  ///< integral of the variance of the kernel within cells
  double unoccluded_ = 0, residual_squared_ = 0, norm_squared_ = 0;
  glm::dvec3 gradient_a_{0}, gradient_b_{0};
};

}  // namespace rebounce
