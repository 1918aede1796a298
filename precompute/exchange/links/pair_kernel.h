#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce {

/// What two nodes exchange with nothing between, as the kernel between their cells has it, and how
/// far that is from affine.
class PairKernel {
 public:
  PairKernel(const LinkTree& tree, const ShadowRays& shadow_rays)
      : tree_(tree), shadow_rays_(shadow_rays) {}

  /// Estimates the pair (a, b). False where cells are too near each other to tell; then nothing
  /// else holds.
  bool estimate(std::uint32_t a, std::uint32_t b);

  double unoccluded() const { return unoccluded_; }             ///< exchange area, m²
  const glm::dvec3& gradient_a() const { return gradient_a_; }  ///< of it, m; see Link
  const glm::dvec3& gradient_b() const { return gradient_b_; }

  /// The integral over both nodes of (kernel - what it is taken for)², of dimension 1.
  double residual_squared() const { return residual_squared_; }

  /// True if some cells face each other and some do not: light would leak to what is behind.
  bool faces_in_part() const { return faces_in_part_; }

  /// The integral of kernel² likewise.
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
  double uncertain_ = 0;  ///< integral of the kernel's variance within cells
  double unoccluded_ = 0, residual_squared_ = 0, norm_squared_ = 0;
  glm::dvec3 gradient_a_{0}, gradient_b_{0};
};

}  // namespace rebounce
