#pragma once

#include <array>
#include <cstddef>

#include "transfer/base/incoming_link.h"

namespace rebounce {

// Three colour channels and one unused float, so that a colour is a vector.
inline constexpr std::size_t kColorLanes = 4;
using ColorLanes = std::array<float, kColorLanes>;

/// The light of a node. In the pull: its mean and its first moments over the area. In the push: the
/// flux that arrived, m² lx, and its gradients, m lx.
template <typename Lanes>
struct LinkLightOf {
  Lanes mean;
  std::array<Lanes, 3> first;
};
using LinkLight = LinkLightOf<ColorLanes>;
static_assert(sizeof(LinkLight) == 64);

/// The light of nodes as links read it. Most links need no moments, and the moments of many lights
/// fill cache lines of their own, so means and moments are apart.
template <typename Lanes>
class NodeLights {
 public:
  /// Lays out `count` nodes in `memory` [count].
  NodeLights(LinkLightOf<Lanes>* memory, std::size_t count)
      : mean_(reinterpret_cast<Lanes*>(memory)),
        first_(reinterpret_cast<std::array<Lanes, 3>*>(mean_ + count)) {}

  Lanes& mean_of(std::size_t node) const { return mean_[node]; }
  std::array<Lanes, 3>& first_of(std::size_t node) const { return first_[node]; }

 private:
  Lanes* mean_;
  std::array<Lanes, 3>* first_;
};

/// Of one light, all that a link can need is one cache line.
template <>
class NodeLights<ColorLanes> {
 public:
  NodeLights(LinkLight* memory, std::size_t /*count*/) : node_(memory) {}

  ColorLanes& mean_of(std::size_t node) const { return node_[node].mean; }
  std::array<ColorLanes, 3>& first_of(std::size_t node) const { return node_[node].first; }
  const LinkLight* node(std::size_t node) const { return node_ + node; }

 private:
  LinkLight* node_;
};

/// The links of a node.
struct LinksOfNode {
  const PlainLink* plain;
  std::size_t plain_count;
  const IncomingLink* affine;
  std::size_t affine_count;
};

/// Returns what arrives at one node along its links.
template <typename Lanes>
using GatherAlongLinks = LinkLightOf<Lanes> (*)(const LinksOfNode& links,
                                                const NodeLights<Lanes>& light);

// The channels of eight lights.
using ManyFloats = std::array<float, 24>;
using ManyDoubles = std::array<double, 24>;

/// Gathering along links, for one instruction set. For many lights at once, all sets give the same
/// bits.
struct LinkKernels {
  GatherAlongLinks<ColorLanes> gather;
  GatherAlongLinks<ManyFloats> gather_floats;
  GatherAlongLinks<ManyDoubles> gather_doubles;
};

}  // namespace rebounce
