#include "precompute/exchange/links/linked_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "rebounce/error.h"

namespace rebounce {
namespace {

using Eigen::Index;

/// A patch of a list.
struct Member {
  std::uint32_t position;  ///< in the order of the links
  std::uint32_t place;     ///< index in the list
  Float3 centroid;
  float weight;  ///< scale times the square root of the area
};

using Range = std::span<const Member>;

float dot(const float* gradient, const Float3& point, const Float3& center) {
  return gradient[0] * (point[0] - center[0]) + gradient[1] * (point[1] - center[1]) +
         gradient[2] * (point[2] - center[2]);
}

/// The links of each node. A link is listed at both of its nodes.
Grouped<std::uint64_t> links_of_nodes(const FormFactorLinks& links) {
  if (links.pair.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw Error("links: more than 4294967295 cannot be used; ask for fewer patches");
  }
  return {links.first_child.size(), [&](const auto& add) {
            for (std::uint32_t k = 0; k < links.pair.size(); ++k) {
              const auto [a, b] = links.pair[k];
              add(a, k);
              if (a != b) add(b, k);
            }
          }};
}

}  // namespace

/// Writes the entries between two lists of patches. It walks down the tree to all nodes that hold a
/// patch of the shorter list ("near"), and uses those of their links that lead to the other list
/// ("far").
class LinkedMatrix::Filler {
 public:
  Filler(const LinkedMatrix& matrix, std::span<const std::uint32_t> near,
         std::span<const std::uint32_t> far, float* entries, Index near_stride, Index far_stride)
      : matrix_(matrix),
        near_(members(near)),
        far_(members(far)),
        entries_(entries),
        near_stride_(near_stride),
        far_stride_(far_stride) {
    if (far_.empty()) return;
    far_begin_ = far_.front().position;
    far_before_.assign(far_.back().position - far_begin_ + 2, 0);
    for (const auto& m : far_) far_before_[m.position - far_begin_ + 1] = 1;
    for (std::size_t k = 1; k < far_before_.size(); ++k) far_before_[k] += far_before_[k - 1];
  }

  void fill() {
    if (!far_.empty()) visit(0, near_);
  }

 private:
  std::vector<Member> members(std::span<const std::uint32_t> patches) const {
    const PatchTable& table = matrix_.patches_;
    std::vector<Member> result;
    result.reserve(patches.size());
    for (std::uint32_t k = 0; k < patches.size(); ++k) {
      const std::uint32_t p = patches[k];
      result.push_back({matrix_.position_[p], k, table.centroid[p],
                        matrix_.links_.scale[p] * std::sqrt(table.area[p])});
    }
    std::ranges::sort(result, {}, &Member::position);
    return result;
  }

  /// The far patches before a position.
  std::uint32_t far_before(std::uint32_t position) const {
    const std::size_t k = position > far_begin_ ? position - far_begin_ : 0;
    return far_before_[std::min(k, far_before_.size() - 1)];
  }

  Range far_in(const Node& node) const {
    const std::uint32_t begin = far_before(node.begin);
    return Range(far_).subspan(begin, far_before(node.begin + node.count) - begin);
  }

  void visit(std::uint32_t node, Range near) {
    if (near.empty()) return;
    // What the links of a node lead to is disjoint.
    const auto links = matrix_.links_of_node_[node];
    const auto ends_before = [&](std::uint32_t link) {
      const Node& to = matrix_.other_end(link, node);
      return to.begin + to.count <= far_begin_;
    };
    for (auto link = std::ranges::partition_point(links, ends_before); link != links.end();
         ++link) {
      if (matrix_.other_end(*link, node).begin > far_.back().position) break;
      follow(*link, node, near);
    }
    const std::uint32_t child = matrix_.links_.first_child[node];
    if (child == kNone) return;
    const std::uint32_t second = matrix_.nodes_[child + 1].begin;
    const auto split = std::ranges::lower_bound(near, second, {}, &Member::position) - near.begin();
    visit(child, near.first(static_cast<std::size_t>(split)));
    visit(child + 1, near.subspan(static_cast<std::size_t>(split)));
  }

  void follow(std::uint32_t link, std::uint32_t node, Range near) {
    const auto& pair = matrix_.links_.pair[link];
    const bool is_first = pair[0] == node;
    const Node &from = matrix_.nodes_[node], &to = matrix_.nodes_[is_first ? pair[1] : pair[0]];
    const Range far = far_in(to);
    if (far.empty()) return;
    const float* const gradient = matrix_.links_.gradient[link].data();
    const float *near_gradient = gradient, *far_gradient = gradient + 3;
    if (!is_first) std::swap(near_gradient, far_gradient);
    const float exchange = matrix_.links_.exchange_area[link];
    const auto density = static_cast<float>(1 / (from.area * to.area));
    for (const auto& f : far) {
      const float at_far = exchange + dot(far_gradient, f.centroid, to.center);
      const float weight = density * f.weight;
      float* const line = entries_ + static_cast<Index>(f.place) * far_stride_;
      for (const auto& n : near) {
        line[static_cast<Index>(n.place) * near_stride_] =
            (at_far + dot(near_gradient, n.centroid, from.center)) * weight * n.weight;
      }
    }
  }

  const LinkedMatrix& matrix_;
  std::vector<Member> near_, far_;         ///< by position
  std::uint32_t far_begin_ = 0;            ///< the first position of far_
  std::vector<std::uint32_t> far_before_;  ///< far patches before each position from there on
  float* entries_;
  Index near_stride_, far_stride_;
};

LinkedMatrix::LinkedMatrix(const FormFactorLinks& links, const PatchTable& patches)
    : LinkedMatrix(links,
                   std::make_shared<const LinkedFormFactors>(links, patches.area, patches.centroid),
                   patches) {}

LinkedMatrix::LinkedMatrix(const FormFactorLinks& links,
                           std::shared_ptr<const LinkedFormFactors> product,
                           const PatchTable& patches)
    : links_(links),
      patches_(patches),
      product_(std::move(product)),
      position_(patches.size()),
      links_of_node_(links_of_nodes(links)) {
  for (std::uint32_t k = 0; k < links.patch.size(); ++k) position_[links.patch[k]] = k;
  measure_nodes();
  sort_links();
}

void LinkedMatrix::sort_links() {
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const auto node = static_cast<std::uint32_t>(k);
    std::ranges::sort(links_of_node_[node], {},
                      [&](std::uint32_t link) { return other_end(link, node).begin; });
  }
}

void LinkedMatrix::measure_nodes() {
  const std::size_t m = links_.first_child.size();
  const std::vector<std::uint32_t> begin = first_positions(links_);
  nodes_.resize(m);
  std::vector<std::array<double, 3>> moment(m);
  for (std::size_t k = m; k-- > 0;) {
    Node& node = nodes_[k];
    node.begin = begin[k];
    node.count = links_.count[k];
    const std::uint32_t child = links_.first_child[k];
    const std::uint32_t patch = links_.patch[node.begin];
    node.area = child == kNone ? patches_.area[patch] : nodes_[child].area + nodes_[child + 1].area;
    for (int axis = 0; axis < 3; ++axis) {
      moment[k][axis] = child == kNone ? node.area * patches_.centroid[patch][axis]
                                       : moment[child][axis] + moment[child + 1][axis];
      node.center[axis] = static_cast<float>(moment[k][axis] / node.area);
    }
  }
}

void LinkedMatrix::entries(std::uint32_t /*matrix*/, std::span<const std::uint32_t> rows,
                           std::span<const std::uint32_t> columns,
                           Eigen::Ref<Eigen::MatrixXf> entries) const {
  entries.setZero();
  if (rows.size() <= columns.size()) {
    Filler(*this, rows, columns, entries.data(), 1, entries.outerStride()).fill();
  } else {
    Filler(*this, columns, rows, entries.data(), entries.outerStride(), 1).fill();
  }
}

template <typename Columns>
void LinkedMatrix::multiply_some(const Eigen::MatrixXf& x, Index begin,
                                 Eigen::MatrixXf& result) const {
  const std::size_t n = patches_.size();
  const Index count = std::min<Index>(std::tuple_size_v<Columns>, x.cols() - begin);
  std::vector<Columns> in(n), out(n);
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    for (Index c = 0; c < count; ++c) {
      in[i][c] = x(static_cast<Index>(i), begin + c) / std::sqrt(patches_.area[i]);
    }
  }
  product_->gather(std::span<const Columns>(in), std::span(out));
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    for (Index c = 0; c < count; ++c) {
      result(static_cast<Index>(i), begin + c) = out[i][c] * std::sqrt(patches_.area[i]);
    }
  }
}

Eigen::MatrixXf LinkedMatrix::multiply(std::uint32_t /*matrix*/, const Eigen::MatrixXf& x) const {
  constexpr Index kMany = 24;
  Eigen::MatrixXf result(x.rows(), x.cols());
  Index begin = 0;
  for (; x.cols() - begin > kChannelCount; begin += kMany) {
    multiply_some<std::array<float, kMany>>(x, begin, result);
  }
  for (; begin < x.cols(); begin += kChannelCount) multiply_some<Float3>(x, begin, result);
  return result;
}

}  // namespace rebounce
