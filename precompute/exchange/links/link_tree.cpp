#include "precompute/exchange/links/link_tree.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "precompute/patches/cluster_tree.h"

namespace rebounce {
namespace {

// Normals whose cosine is above this belong to one plane; positions in single precision resolve no
// more.
constexpr double kFlat = 1 - 1e-12;

// Points closer to a plane than this fraction of the size of the nodes count as on it, as in the
// kernel.
constexpr double kPlaneTolerance = 1e-7;

// A node has no gradient in directions in which it is thinner than this fraction of its size.
constexpr double kThin = 1e-3;

// A mean normal shorter than this is a rounding error.
constexpr double kNoAxis = 1e-6;

void enclose(const FlatTriangle& t, LinkNode& node) {
  node.cone_cosine = std::min(node.cone_cosine, glm::dot(node.axis, t.normal));
  for (const glm::dvec3& v : t.vertex) {
    node.low = glm::min(node.low, v);
    node.high = glm::max(node.high, v);
    node.lowest = std::min(node.lowest, glm::dot(node.axis, v));
    node.highest = std::max(node.highest, glm::dot(node.axis, v));
  }
}

/// An upper bound of dot(axis, x) over node `b`: the least of its bounds.
double highest_along(const glm::dvec3& axis, const LinkNode& b) {
  const glm::dvec3 middle = 0.5 * (b.low + b.high), half = 0.5 * (b.high - b.low);
  double highest = std::min(glm::dot(axis, b.center) + b.radius,
                            glm::dot(axis, middle) + glm::dot(glm::abs(axis), half));
  const double side = glm::dot(axis, b.axis) < 0 ? -1 : 1;
  const glm::dvec3 tilt = axis - side * b.axis;
  const double slab = side > 0 ? b.highest : -b.lowest;
  const double tilted = glm::dot(tilt, b.center) + glm::length(tilt) * b.radius;
  return std::min(highest, slab + tilted);
}

/// True if no part of `b` lies in front of the plane of any patch of `a`.
bool is_behind(const LinkNode& a, const LinkNode& b) {
  if (a.is_flat()) {
    return highest_along(a.axis, b) <= a.lowest + kPlaneTolerance * std::max(a.radius, b.radius);
  }
  const glm::dvec3 d = b.center - a.center;
  const double distance = glm::length(d), reach = a.radius + b.radius;
  if (distance <= reach || a.cone_cosine <= 0) return false;
  const double between = std::acos(std::clamp(glm::dot(a.axis, d) / distance, -1.0, 1.0));
  const double widest = std::acos(a.cone_cosine) + std::asin(reach / distance);
  return between - widest >= 0.5 * std::numbers::pi;
}

}  // namespace

bool LinkNode::is_flat() const {
  return cone_cosine >= kFlat;
}

bool cannot_exchange(const LinkNode& a, const LinkNode& b) {
  return is_behind(a, b) || is_behind(b, a);
}

LinkTree::LinkTree(const PatchModel& model, const PatchGeometry& geometry) {
  ClusterTree tree = build_cluster_tree(model.patches, 1, 1);
  patch_ = std::move(tree.patch);
  area_before_.resize(patch_.size() + 1);
  for (std::size_t k = 0; k < patch_.size(); ++k) {
    area_before_[k + 1] = area_before_[k] + geometry.area(patch_[k]);
  }
  nodes_.resize(tree.clusters.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    nodes_[k].begin = tree.clusters[k].begin;
    nodes_[k].count = tree.clusters[k].count;
    nodes_[k].first_child = tree.clusters[k].first_child;
    bound(nodes_[k], geometry);
  }
  cell_begin_ = {0};
  for (std::uint32_t k = 0; k < nodes_.size(); ++k) {
    choose_cells(k);
    invert_moment(k);
  }
}

void LinkTree::bound(LinkNode& node, const PatchGeometry& geometry) const {
  for (const std::uint32_t patch : patches(node)) {
    node.area += geometry.area(patch);
    for (const FlatTriangle& t : geometry.triangles(patch)) {
      node.center += t.stopping_area() * t.centroid;
      node.normal += t.stopping_area() * t.normal;
    }
  }
  node.center /= node.area;
  node.normal /= node.area;
  const double length = glm::length(node.normal);
  if (length > kNoAxis) node.axis = node.normal / length;
  for (const std::uint32_t patch : patches(node)) {
    const PatchBounds& bounds = geometry.bounds(patch);
    node.radius = std::max(node.radius, glm::distance(node.center, bounds.centre) + bounds.radius);
    for (const FlatTriangle& t : geometry.triangles(patch)) enclose(t, node);
  }
}

/// Cuts the node into parts of about equal area.
void LinkTree::choose_cells(std::uint32_t node) {
  std::vector<std::uint32_t> cells = {node};
  while (cells.size() < kCellCount) {
    const auto largest = std::ranges::max_element(
        cells, {}, [&](std::uint32_t c) { return nodes_[c].is_leaf() ? 0.0 : nodes_[c].area; });
    const std::uint32_t first = nodes_[*largest].first_child;
    if (first == kNone) break;
    *largest = first;
    cells.push_back(first + 1);
  }
  cells_.insert(cells_.end(), cells.begin(), cells.end());
  cell_begin_.push_back(static_cast<std::uint32_t>(cells_.size()));
}

void LinkTree::invert_moment(std::uint32_t node) {
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const std::uint32_t cell : cells(node)) {
    const glm::dvec3 d = nodes_[cell].center - nodes_[node].center;
    const Eigen::Vector3d e(d.x, d.y, d.z);
    moment += nodes_[cell].area * e * e.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moment);
  const double least = kThin * kThin * solver.eigenvalues()[2];
  if (solver.eigenvalues()[2] <= 0) return;
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (solver.eigenvalues()[k] <= least) continue;
    const Eigen::Vector3d v = solver.eigenvectors().col(k);
    inverse += v * v.transpose() / solver.eigenvalues()[k];
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) nodes_[node].inverse_moment[i][j] = inverse(i, j);
  }
}

std::uint32_t LinkTree::patch_at(const LinkNode& node, double fraction) const {
  if (node.is_leaf()) return leaf_patch(node);
  const auto begin = area_before_.begin() + node.begin, end = begin + node.count;
  const double wanted = *begin + fraction * (*end - *begin);
  const auto after = std::upper_bound(begin + 1, end, wanted);
  const auto position = node.begin + static_cast<std::uint32_t>(after - begin) - 1;
  return patch_[std::min(position, node.begin + node.count - 1)];
}

}  // namespace rebounce
