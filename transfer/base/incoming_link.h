#pragma once

#include <cstdint>

#include "transfer/base/bfloat16.h"

namespace rebounce {

/// A link without gradients, as of two single patches, as seen from the node that gathers along it.
struct PlainLink {
  std::uint32_t from;   ///< the other node
  float exchange_area;  ///< m²
};
static_assert(sizeof(PlainLink) == 8);

/// A link with gradients, likewise. Gradients are small corrections, so bfloat16 is precise enough
/// for them.
struct IncomingLink {
  BFloat16x3 gradient_from;  ///< of the exchange area over the other node, m
  BFloat16x3 gradient_to;    ///< of the exchange area over the node that gathers, m
  std::uint32_t from;        ///< the other node
  float exchange_area;       ///< m²
};
static_assert(sizeof(IncomingLink) == 20);

/// Whether a gradient of an IncomingLink is not 0.
constexpr bool has_gradient(const BFloat16x3& gradient) {
  return (gradient[0] | gradient[1] | gradient[2]) != 0;
}

/// The same link, with gradients of 0.
constexpr IncomingLink affine(const PlainLink& link) {
  return {{}, {}, link.from, link.exchange_area};
}
constexpr const IncomingLink& affine(const IncomingLink& link) {
  return link;
}

/// Which gradients a link has, below kGradientKinds; 0 is for a PlainLink.
constexpr unsigned gradients_of(const IncomingLink& link) {
  return (has_gradient(link.gradient_from) ? 2U : 0U) + (has_gradient(link.gradient_to) ? 1U : 0U);
}
inline constexpr unsigned kGradientKinds = 4;

}  // namespace rebounce
