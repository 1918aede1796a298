#include "precompute/exchange/links/linked_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
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

float dot(const Float3& gradient, const Float3& point, const Float3& center) {
  return gradient[0] * (point[0] - center[0]) + gradient[1] * (point[1] - center[1]) +
         gradient[2] * (point[2] - center[2]);
}

}  // namespace

/// The links between two lists of patches. It walks down the tree to all nodes that hold a patch of
/// the one list ("near"), and finds those of their links that lead to the other list ("far").
class LinkedMatrix::LinksBetween {
 public:
  LinksBetween(const LinkedMatrix& matrix, std::span<const std::uint32_t> near,
               std::span<const std::uint32_t> far)
      : matrix_(matrix), near_(members(near)), far_(members(far)) {
    if (far_.empty()) return;
    far_begin_ = far_.front().position;
    far_before_.assign(far_.back().position - far_begin_ + 2, 0);
    for (const auto& m : far_) far_before_[m.position - far_begin_ + 1] = 1;
    for (std::size_t k = 1; k < far_before_.size(); ++k) far_before_[k] += far_before_[k - 1];
  }

  /// Calls `follow`(link, node, near, far) with each link, the node that it belongs to, and the
  /// patches at its two ends, until it returns false.
  template <typename Follow>
  void for_each(const Follow& follow) const {
    if (!far_.empty()) visit(0, near_, follow);
  }

 private:
  std::vector<Member> members(std::span<const std::uint32_t> patches) const {
    const PatchTable& table = matrix_.patches_;
    std::vector<Member> result;
    result.reserve(patches.size());
    for (std::uint32_t k = 0; k < patches.size(); ++k) {
      const std::uint32_t p = patches[k];
      result.push_back({matrix_.position_[p], k, table.centroid[p],
                        matrix_.links_->nodes().scale[p] * std::sqrt(table.area[p])});
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

  template <typename Follow>
  bool visit(std::uint32_t node, Range near, const Follow& follow) const {
    if (near.empty()) return true;
    if (!follow_some(matrix_.links_->plain_links(node), node, near, follow)) return false;
    const std::span<const IncomingLink> affine = matrix_.links_->affine_links(node);
    for (auto begin = affine.begin(); begin != affine.end();) {
      const auto end =
          std::ranges::upper_bound(begin, affine.end(), gradients_of(*begin), {}, gradients_of);
      if (!follow_some(std::span<const IncomingLink>{begin, end}, node, near, follow)) return false;
      begin = end;
    }
    const std::uint32_t child = matrix_.links_->nodes().first_child[node];
    if (child == kNone) return true;
    const std::uint32_t second = matrix_.nodes_[child + 1].begin;
    const auto split = std::ranges::lower_bound(near, second, {}, &Member::position) - near.begin();
    return visit(child, near.first(static_cast<std::size_t>(split)), follow) &&
           visit(child + 1, near.subspan(static_cast<std::size_t>(split)), follow);
  }

  /// Follows those links of `node` that lead to far patches. What they lead to is disjoint and in
  /// order.
  template <typename Link, typename Follow>
  bool follow_some(std::span<const Link> links, std::uint32_t node, Range near,
                   const Follow& follow) const {
    const auto ends_before = [&](const Link& link) {
      const Node& to = matrix_.nodes_[link.from];
      return to.begin + to.count <= far_begin_;
    };
    for (auto link = std::ranges::partition_point(links, ends_before); link != links.end();
         ++link) {
      if (matrix_.nodes_[link->from].begin > far_.back().position) break;
      const Range far = far_in(matrix_.nodes_[link->from]);
      if (!far.empty() && !follow(affine(*link), matrix_.nodes_[node], near, far)) return false;
    }
    return true;
  }

  const LinkedMatrix& matrix_;
  std::vector<Member> near_, far_;         ///< by position
  std::uint32_t far_begin_ = 0;            ///< the first position of far_
  std::vector<std::uint32_t> far_before_;  ///< far patches before each position from there on
};

/// Writes the entries between two lists of patches. The near list is the shorter one.
class LinkedMatrix::Filler {
 public:
  Filler(const LinkedMatrix& matrix, std::span<const std::uint32_t> near,
         std::span<const std::uint32_t> far, float* entries, Index near_stride, Index far_stride)
      : matrix_(matrix),
        links_(matrix, near, far),
        entries_(entries),
        near_stride_(near_stride),
        far_stride_(far_stride) {}

  void fill() const {
    links_.for_each([&](const IncomingLink& link, const Node& node, Range near, Range far) {
      write(link, node, near, far);
      return true;
    });
  }

 private:
  void write(const IncomingLink& link, const Node& from, Range near, Range far) const {
    const Node& to = matrix_.nodes_[link.from];
    const Float3 near_gradient = to_floats(link.gradient_to),
                 far_gradient = to_floats(link.gradient_from);
    const auto density = static_cast<float>(1 / (from.area * to.area));
    for (const auto& f : far) {
      const float at_far = link.exchange_area + dot(far_gradient, f.centroid, to.center);
      const float weight = density * f.weight;
      float* const line = entries_ + static_cast<Index>(f.place) * far_stride_;
      for (const auto& n : near) {
        line[static_cast<Index>(n.place) * near_stride_] =
            (at_far + dot(near_gradient, n.centroid, from.center)) * weight * n.weight;
      }
    }
  }

  const LinkedMatrix& matrix_;
  LinksBetween links_;
  float* entries_;
  Index near_stride_, far_stride_;
};

LinkedMatrix::LinkedMatrix(std::shared_ptr<const LinkedFormFactors> links,
                           const PatchTable& patches, std::vector<std::uint8_t> group)
    : SymmetricMatrix({}, std::move(group)),
      patches_(patches),
      links_(std::move(links)),
      position_(patches.size()) {
  const std::size_t n = patches.size();
  if (links_->patch_count() != n || patches.centroid.size() != n) {
    throw Error("links: they are for another number of patches");
  }
  for (std::uint32_t k = 0; k < n; ++k) position_[links_->nodes().patch[k]] = k;
  measure_nodes();
}

void LinkedMatrix::measure_nodes() {
  const LinkedNodes& tree = links_->nodes();
  const std::size_t m = tree.first_child.size();
  nodes_.resize(m);
  std::vector<std::array<double, 3>> moment(m);
  for (std::size_t k = m; k-- > 0;) {
    Node& node = nodes_[k];
    node.begin = links_->first_positions()[k];
    node.count = tree.count[k];
    const std::uint32_t child = tree.first_child[k];
    const std::uint32_t patch = tree.patch[node.begin];
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

bool LinkedMatrix::is_zero(std::span<const std::uint32_t> rows,
                           std::span<const std::uint32_t> columns) const {
  bool found = false;
  const auto stop = [&](const IncomingLink&, const Node&, Range, Range) {
    found = true;
    return false;
  };
  LinksBetween(*this, rows, columns).for_each(stop);
  return !found;
}

template <typename Columns>
void LinkedMatrix::multiply_some(const Eigen::MatrixXf& x, Index begin,
                                 GatheredLights<Columns>& lights, Eigen::MatrixXf& result) const {
  const std::size_t n = patches_.size();
  const Index count = std::min<Index>(std::tuple_size_v<Columns>, x.cols() - begin);
  lights.in.resize(n);
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    for (Index c = 0; c < count; ++c) {
      lights.in[i][c] = x(static_cast<Index>(i), begin + c) / std::sqrt(patches_.area[i]);
    }
  }
  links_->gather(lights);
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    for (Index c = 0; c < count; ++c) {
      result(static_cast<Index>(i), begin + c) = lights.out[i][c] * std::sqrt(patches_.area[i]);
    }
  }
}

Eigen::MatrixXf LinkedMatrix::multiply(std::uint32_t /*matrix*/, const Eigen::MatrixXf& x) const {
  constexpr Index kMany = 24;
  Eigen::MatrixXf result(x.rows(), x.cols());
  Index begin = 0;
  GatheredLights<std::array<float, kMany>> many;
  for (; x.cols() - begin > kChannelCount; begin += kMany) multiply_some(x, begin, many, result);
  GatheredLights<Float3> few;
  for (; begin < x.cols(); begin += kChannelCount) multiply_some(x, begin, few, result);
  return result;
}

}  // namespace rebounce
