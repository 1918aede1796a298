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

/// Gathering along links, for one instruction set.
struct LinkKernels {
  const char* instruction_set;

  /// What arrives at one node along its `count` links.
  LinkLight (*gather)(const IncomingLink* link, std::size_t count, const LinkLight* light);
};

extern const LinkKernels kLinkKernelsPortable;
extern const LinkKernels kLinkKernelsAvx2;
extern const LinkKernels kLinkKernelsAvx512;

/// The kernels that this processor runs, narrowest first, and the widest of them.
std::span<const LinkKernels* const> link_kernel_sets();
const LinkKernels& link_kernels();

}  // namespace rebounce
