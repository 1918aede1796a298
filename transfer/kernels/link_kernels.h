#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace rebounce {

/// A link as the node that gathers along it sees it: 20 bytes. Gradients are corrections, and are
/// kept as bfloat16, the upper half of a float.
struct IncomingLink {
  std::array<std::uint16_t, 3> gradient_from;  ///< of the exchange area over the other node, m
  std::array<std::uint16_t, 3> gradient_to;    ///< over the node that gathers
  std::uint32_t from;                          ///< the other node
  float exchange_area;                         ///< m²
};
static_assert(sizeof(IncomingLink) == 20);

// Colour channels and one more, so that a colour is one vector.
inline constexpr std::size_t kColorLanes = 4;
using ColorLanes = std::array<float, kColorLanes>;

/// Of a node: in the pull, mean light and its first cluster coefficients over the area; in the
/// push, what arrived, m² lx, and its gradients, m lx.
template <typename Lanes>
struct LinkLightOf {
  Lanes mean;
  std::array<Lanes, 3> first;
};
using LinkLight = LinkLightOf<ColorLanes>;
static_assert(sizeof(LinkLight) == 64);

/// What arrives at one node along its `count` links.
template <typename Lanes>
using GatherAlongLinks = LinkLightOf<Lanes> (*)(const IncomingLink* link, std::size_t count,
                                                const LinkLightOf<Lanes>* light);

// The channels of eight lights.
using ManyFloats = std::array<float, 24>;
using ManyDoubles = std::array<double, 24>;

/// Gathering along links, for one instruction set; many lights with the same bits for any of them.
struct LinkKernels {
  GatherAlongLinks<ColorLanes> gather;
  GatherAlongLinks<ManyFloats> gather_floats;
  GatherAlongLinks<ManyDoubles> gather_doubles;
};

}  // namespace rebounce
