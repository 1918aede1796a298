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
                                                const LinkLightOf<Lanes>* light);

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
