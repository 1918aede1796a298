#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/patch_geometry.h"
#include "precompute/patches/patch_model.h"

namespace rebounce {

/// The properties of a set of patches that the refinement of links needs.
struct LinkNode {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  std::uint32_t begin = 0, count = 0;  ///< positions in the tree's order of patches
  std::uint32_t first_child = kNone;   ///< the second child follows it; kNone for a single patch
  double area = 0;                     ///< m²
  glm::dvec3 center{0};                ///< area-weighted, metres
  double radius = 0;                   ///< of the sphere around `center` that holds every patch
  glm::dvec3 low{kInfinity}, high{-kInfinity};  ///< box around all patches
  glm::dvec3 normal{0};                         ///< area-weighted mean, not of unit length
  glm::dvec3 axis{0};                           ///< `normal` at unit length; 0 if there is none
  double cone_cosine = 1;  ///< least cosine between `axis` and a patch's normal
  double lowest = kInfinity,
         highest = -kInfinity;  ///< limits of dot(axis, x) over all patches
  /// Maps the first moment of a quantity over the cells to its gradient: the pseudo-inverse of the
  /// second moment of the cells, 1/m⁴.
  glm::dmat3 inverse_moment{0};

  bool is_leaf() const { return first_child == kNone; }
  bool is_flat() const;  ///< all patches face the same way
};

/// A binary tree over the patches whose leaves are single patches. It stores bounds, and for each
/// node a few descendants ("cells") that represent it in estimates of integrals.
class LinkTree {
 public:
  /// The most cells of a node. More cells make integrals over pairs of nodes more exact, at a cost
  /// that grows with the square.
  static constexpr std::uint32_t kCellCount = 16;

  LinkTree(const PatchModel& model, const PatchGeometry& geometry);

  std::span<const LinkNode> nodes() const { return nodes_; }
  const LinkNode& operator[](std::uint32_t node) const { return nodes_[node]; }
  std::span<const std::uint32_t> cells(std::uint32_t node) const {
    return {cells_.data() + cell_begin_[node], cells_.data() + cell_begin_[node + 1]};
  }
  std::span<const std::uint32_t> patches() const { return patch_; }  ///< [n] patch at each position
  std::span<const std::uint32_t> patches(const LinkNode& node) const {
    return std::span(patch_).subspan(node.begin, node.count);
  }
  std::uint32_t leaf_patch(const LinkNode& leaf) const { return patch_[leaf.begin]; }

  /// The patch of a node at which the fraction `fraction` in [0, 1) of its area is reached.
  std::uint32_t patch_at(const LinkNode& node, double fraction) const;

 private:
  void bound(LinkNode& node, const PatchGeometry& geometry) const;
  void choose_cells(std::uint32_t node);
  void invert_moment(std::uint32_t node);

  std::vector<std::uint32_t> patch_;
  std::vector<double> area_before_;  ///< [n + 1] area of all positions before each
  std::vector<LinkNode> nodes_;      ///< level by level
  std::vector<std::uint32_t> cell_begin_, cells_;
};

/// True if it is certain that no patch of `a` exchanges light with a patch of `b`.
bool cannot_exchange(const LinkNode& a, const LinkNode& b);

}  // namespace rebounce
