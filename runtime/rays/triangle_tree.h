#pragma once

// A bounding volume hierarchy over triangles, for builds without Embree.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "rebounce/types.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Boxes around triangles, four to a node, down to leaves of four triangles. Four boxes or
/// triangles are tested at once with the vector extension of GCC and Clang.
///
/// Edges that triangles share let no ray through: each is tested by the volume that it spans with
/// the ray, whose sign is that of the other triangle turned round (S. Woop, C. Benthin, I. Wald,
/// "Watertight ray/triangle intersection", JCGT 2(1), 2013, tells of the matter). Immutable.
class TriangleTree {
 public:
  /// Indices must be in range. The same triangles give the same tree.
  TriangleTree(std::span<const Float3> position, std::span<const Uint3> triangle);

  /// Calls visit(hit) for hits of `ray` with t in (t_near, t_far], nearer boxes first. It returns
  /// the new t_far: the ray's own to go on, hit.t to look for nearer hits alone, less than t_near
  /// to stop. Each triangle is hit once at most.
  template <typename Visit>
  void trace(const Ray& ray, const Visit& visit) const {
    const Beam beam(ray);
    float t_far = ray.t_far;
    std::array<Entry, kStackSize> stack;
    std::size_t waiting = 0;
    if (!node_.empty()) stack[waiting++] = {beam.t_near, 0};
    while (waiting > 0) {
      const Entry next = stack[--waiting];
      if (next.t > t_far) continue;
      if (next.child < 0) {
        t_far = visit_leaf(beam, leaf_[leaf_number(next.child)], t_far, visit);
        if (t_far < beam.t_near) return;
        continue;
      }
      push_children(beam, node_[static_cast<std::size_t>(next.child)], t_far, stack, waiting);
    }
  }

 private:
  static constexpr std::size_t kWidth = 4;
  using Four = float __attribute__((vector_size(16)));
  using Mask = std::int32_t __attribute__((vector_size(16)));

  static constexpr std::size_t kMostDepth = 48;  // of a tree; beyond it ranges are halved
  static constexpr std::size_t kStackSize = 3 * kMostDepth + 32 * 3 + 4;

  struct Node {
    /// Low and high sides [axis] of the children; turned round where there is none: no ray meets
    /// it.
    std::array<std::array<Four, 3>, 2> side;
    std::array<std::int32_t, kWidth> child;  ///< a node, or ~ a leaf
  };
  struct Leaf {
    std::array<std::array<Four, 3>, 3> corner;   ///< [corner][axis]
    std::array<std::uint32_t, kWidth> triangle;  ///< kNone: nothing there
  };
  struct Entry {
    float t;
    std::int32_t child;
  };

  /// A ray, repeated in the lanes of vectors.
  struct Beam {
    std::array<Four, 3> origin, direction, inverse;
    std::array<bool, 3> backward;  ///< the ray meets the high side of a box first
    float t_near;

    explicit Beam(const Ray& ray) : t_near(ray.t_near) {
      constexpr float kLeast = 1e-18F;  // a smaller part of a direction would make infinities
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float d = ray.direction[axis];
        origin[axis] = repeat(ray.origin[axis]);
        direction[axis] = repeat(d);
        backward[axis] = std::signbit(d);
        inverse[axis] = repeat(1 / std::copysign(std::max(std::abs(d), kLeast), d));
      }
    }
  };

  struct Item;
  struct Range;
  class Builder;

  static std::size_t leaf_number(std::int32_t child) {
    const std::int32_t number = ~child;
    return static_cast<std::size_t>(number);
  }
  static Four repeat(float x) { return Four{x, x, x, x}; }
  static Four smaller(const Four& a, const Four& b) { return a < b ? a : b; }
  static Four larger(const Four& a, const Four& b) { return a > b ? a : b; }
  static Four magnitude(const Four& a) { return a < 0 ? -a : a; }
  static Four dot(const std::array<Four, 3>& a, const std::array<Four, 3>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  static std::array<Four, 3> cross(const std::array<Four, 3>& a, const std::array<Four, 3>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static bool none(const Mask& mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) == 0; }

  /// Puts the children that the ray meets on the stack, the nearest on top.
  static void push_children(const Beam& beam, const Node& node, float t_far,
                            std::array<Entry, kStackSize>& stack, std::size_t& waiting) {
    // Distances are rounded: boxes count as a little larger.
    constexpr float kMore = 1 + 4 * std::numeric_limits<float>::epsilon();
    constexpr float kLess = 1 - 4 * std::numeric_limits<float>::epsilon();
    Four enter = repeat(beam.t_near), leave = repeat(t_far);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool backward = beam.backward[axis];
      const Four& first = node.side[backward ? 1 : 0][axis];
      const Four& last = node.side[backward ? 0 : 1][axis];
      enter = larger(enter, (first - beam.origin[axis]) * beam.inverse[axis] * kLess);
      leave = smaller(leave, (last - beam.origin[axis]) * beam.inverse[axis] * kMore);
    }
    const Mask met = enter <= leave;
    if (none(met)) return;
    const std::size_t bottom = waiting;
    for (std::size_t k = 0; k < kWidth; ++k) {
      if (met[k] == 0) continue;
      std::size_t place = waiting++;
      for (; place > bottom && stack[place - 1].t < enter[k]; --place)
        stack[place] = stack[place - 1];
      stack[place] = {enter[k], node.child[k]};
    }
  }

  template <typename Visit>
  static float visit_leaf(const Beam& beam, const Leaf& leaf, float t_far, const Visit& visit) {
    std::array<std::array<Four, 3>, 3> corner, edge;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        corner[k][axis] = leaf.corner[k][axis] - beam.origin[axis];
      }
    }
    std::array<Four, 3> volume;  // of the edge opposite each corner, with the ray
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& from = corner[(k + 1) % 3];
      const auto& to = corner[(k + 2) % 3];
      std::array<Four, 3> sum;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        edge[k][axis] = from[axis] - to[axis];
        sum[axis] = from[axis] + to[axis];
      }
      volume[k] = dot(cross(sum, edge[k]), beam.direction);
    }
    const Four whole = volume[0] + volume[1] + volume[2];
    const Four slack = magnitude(whole) * std::numeric_limits<float>::epsilon();
    const Four least = smaller(volume[0], smaller(volume[1], volume[2]));
    const Four most = larger(volume[0], larger(volume[1], volume[2]));
    const Mask inside = (least >= -slack) | (most <= slack);
    if (none(inside)) return t_far;

    const std::array<Four, 3> normal = cross(edge[1], edge[2]);
    const Four facing = dot(normal, beam.direction);
    const Four t = dot(corner[0], normal) / facing;
    const Mask hit = inside & (facing != 0) & (t > beam.t_near) & (t <= t_far);
    for (std::size_t k = 0; k < kWidth; ++k) {
      if (hit[k] == 0 || t[k] > t_far || leaf.triangle[k] == kNone) continue;
      t_far = visit(Hit{.t = t[k],
                        .triangle = leaf.triangle[k],
                        .u = volume[1][k] / whole[k],
                        .v = volume[2][k] / whole[k],
                        .front = facing[k] < 0});
      if (t_far < beam.t_near) break;
    }
    return t_far;
  }

  std::vector<Node> node_;
  std::vector<Leaf> leaf_;
};

}  // namespace rebounce
