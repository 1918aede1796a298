#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "rebounce/transfer/linked_form_factors.h"

namespace rebounce {

// Colour channels and one more, so that a colour is one vector.
inline constexpr std::size_t kColorLanes = 4;
using ColorLanes = std::array<float, kColorLanes>;

/// Of a node: in the pull, mean light and its first moments over the area; in the push, what
/// arrived, m² lx, and its gradients, m lx.
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
  const char* instruction_set;
  GatherAlongLinks<ColorLanes> gather;
  GatherAlongLinks<ManyFloats> gather_floats;
  GatherAlongLinks<ManyDoubles> gather_doubles;
};

extern const LinkKernels kLinkKernelsPortable;
extern const LinkKernels kLinkKernelsAvx2;
extern const LinkKernels kLinkKernelsAvx512;

/// The kernels that this processor runs, narrowest first, and the widest of them.
std::span<const LinkKernels* const> link_kernel_sets();
const LinkKernels& link_kernels();

}  // namespace rebounce
