#include "precompute/exchange/links/pair_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

// Cells closer than this multiple of the sum of their radii are too near for the kernel between
// their centres.
constexpr double kNear = 1.0;
// Pairs of patches closer than this use the kernel of patches instead, with this tolerance.
constexpr double kNearPatches = 3.0, kPatchTolerance = 1e-2;
// Mean squared distance of the points of a cell from a plane through its centre, in squares of its
// radius.
constexpr double kSpread = 0.1;
// Nodes closer than this are not examined: their kernel is never nearly affine.
constexpr double kTouching = 0.75;

/// Variance of a cosine, because normals differ within a cell.
double normal_variance(const LinkNode& cell) {
  return 1 - std::min(1.0, glm::dot(cell.normal, cell.normal));
}

/// Variance of the height above a plane, because a part of `cell` may lie in front of the plane and
/// the rest behind it.
double horizon_variance(double height, const LinkNode& cell) {
  return std::abs(height) < cell.radius ? kSpread * cell.radius * cell.radius : 0;
}

}  // namespace

bool PairKernel::estimate(std::uint32_t a, std::uint32_t b) {
  const double reach = kTouching * (tree_[a].radius + tree_[b].radius);
  if (glm::distance(tree_[a].center, tree_[b].center) < reach) return false;
  const Cells cells_a = tree_.cells(a), cells_b = tree_.cells(b);
  if (!fill(cells_a, cells_b)) return false;
  const auto pairs = std::span(kernel_).first(cells_a.size() * cells_b.size());
  const auto dark = std::ranges::count(pairs, 0.0);
  faces_in_part_ = dark > 0 && dark < static_cast<std::ptrdiff_t>(pairs.size());
  fit(tree_[a], cells_a, tree_[b], cells_b);
  limit(tree_[a], cells_a, tree_[b], cells_b);
  measure(tree_[a], cells_a, tree_[b], cells_b);
  return true;
}

bool PairKernel::fill(Cells cells_a, Cells cells_b) {
  uncertain_ = 0;
  std::size_t k = 0;
  for (const std::uint32_t p : cells_a) {
    for (const std::uint32_t q : cells_b) {
      if (!fill(tree_[p], tree_[q], kernel_[k++])) return false;
    }
  }
  return true;
}

bool PairKernel::fill(const LinkNode& p, const LinkNode& q, double& kernel) {
  const glm::dvec3 d = q.center - p.center;
  const double r2 = glm::dot(d, d), reach = p.radius + q.radius;
  const double area = p.area * q.area;
  if (p.is_leaf() && q.is_leaf()) {
    if (r2 < kNearPatches * kNearPatches * reach * reach) {
      kernel = exchange_of_patches(p, q) / area;
      return true;
    }
  } else if (r2 < kNear * kNear * reach * reach) {
    kernel = 0;
    return cannot_exchange(p, q);
  }
  const double along_p = glm::dot(p.normal, d), along_q = -glm::dot(q.normal, d);
  const double cosine_p = std::max(0.0, along_p), cosine_q = std::max(0.0, along_q);
  const double scale = 1 / (std::numbers::pi * r2 * r2);
  kernel = cosine_p * cosine_q * scale;
  // The variance of either cosine, times r².
  const double sp = r2 * normal_variance(p) + horizon_variance(along_p, q),
               sq = r2 * normal_variance(q) + horizon_variance(along_q, p);
  uncertain_ +=
      area * scale * scale * (sp * cosine_q * cosine_q + sq * cosine_p * cosine_p + sp * sq);
  return true;
}

double PairKernel::exchange_of_patches(const LinkNode& p, const LinkNode& q) const {
  const std::uint32_t i = tree_.leaf_patch(p), j = tree_.leaf_patch(q);
  return shadow_rays_.unoccluded(std::min(i, j), std::max(i, j), kPatchTolerance);
}

/// Least-squares fit: the mean of the kernel, and its first moments over both nodes.
void PairKernel::fit(const LinkNode& a, Cells cells_a, const LinkNode& b, Cells cells_b) {
  glm::dvec3 moment_a(0), moment_b(0);
  unoccluded_ = 0;
  std::size_t k = 0;
  for (const std::uint32_t p : cells_a) {
    double row = 0;
    for (const std::uint32_t q : cells_b) {
      const double exchange = tree_[p].area * tree_[q].area * kernel_[k++];
      row += exchange;
      moment_b += exchange * (tree_[q].center - b.center);
    }
    unoccluded_ += row;
    moment_a += row * (tree_[p].center - a.center);
  }
  gradient_a_ = a.area * (a.inverse_moment * moment_a);
  gradient_b_ = b.area * (b.inverse_moment * moment_b);
}

/// Scales the gradients so that the kernel is nowhere negative.
void PairKernel::limit(const LinkNode& a, Cells cells_a, const LinkNode& b, Cells cells_b) {
  const double most = fall(a, cells_a, gradient_a_) + fall(b, cells_b, gradient_b_);
  if (most <= unoccluded_) return;
  gradient_a_ *= unoccluded_ / most;
  gradient_b_ *= unoccluded_ / most;
}

double PairKernel::fall(const LinkNode& node, Cells cells, const glm::dvec3& gradient) const {
  double most = 0;
  for (const std::uint32_t cell : cells) {
    most = std::max(most, -glm::dot(gradient, tree_[cell].center - node.center));
  }
  return most;
}

void PairKernel::measure(const LinkNode& a, Cells cells_a, const LinkNode& b, Cells cells_b) {
  const double scale = 1 / (a.area * b.area);
  std::array<double, LinkTree::kCellCount> part_b;
  for (std::size_t q = 0; q < cells_b.size(); ++q) {
    part_b[q] = glm::dot(gradient_b_, tree_[cells_b[q]].center - b.center);
  }
  residual_squared_ = norm_squared_ = uncertain_;
  std::size_t k = 0;
  for (const std::uint32_t p : cells_a) {
    const double part_a = unoccluded_ + glm::dot(gradient_a_, tree_[p].center - a.center);
    for (std::size_t q = 0; q < cells_b.size(); ++q, ++k) {
      const double error = kernel_[k] - scale * (part_a + part_b[q]);
      const double area = tree_[p].area * tree_[cells_b[q]].area;
      residual_squared_ += area * error * error;
      norm_squared_ += area * kernel_[k] * kernel_[k];
    }
  }
}

}  // namespace rebounce
