#pragma once

#include "transfer/base/bfloat16.h"
#include "transfer/kernels/link_kernels.h"

namespace rebounce {

// These functions are static: each file compiles its own copy for its instruction set.

/// to += factor * from, lane by lane.
template <typename Lanes>
static inline void add_scaled(Lanes& to, float factor, const Lanes& from) {
  for (std::size_t lane = 0; lane < to.size(); ++lane) to[lane] += factor * from[lane];
}

/// The flux that arrives along links without gradients.
template <typename Lanes>
static inline Lanes gather_along_plain_links(const PlainLink* link, std::size_t count,
                                             const LinkLightOf<Lanes>* light) {
  Lanes sum{};
  for (std::size_t l = 0; l < count; ++l) {
    add_scaled(sum, link[l].exchange_area, light[link[l].from].mean);
  }
  return sum;
}

/// GatherAlongLinks in plain C++, for any number type and number of channels. Moments of many
/// channels come from memory, so they are left alone where a single patch, which has none, is at
/// one end; links of the same kind are next to each other.
template <typename Lanes>
static inline LinkLightOf<Lanes> gather_along_links(const LinksOfNode& links,
                                                    const LinkLightOf<Lanes>* light) {
  LinkLightOf<Lanes> sum{gather_along_plain_links<Lanes>(links.plain, links.plain_count, light),
                         {}};
  const IncomingLink* const link = links.affine;
  for (std::size_t l = 0; l < links.affine_count; ++l) {
    const LinkLightOf<Lanes>& from = light[link[l].from];
    add_scaled(sum.mean, link[l].exchange_area, from.mean);
    if (has_gradient(link[l].gradient_from)) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        add_scaled(sum.mean, bfloat16_to_float(link[l].gradient_from[axis]), from.first[axis]);
      }
    }
    if (has_gradient(link[l].gradient_to)) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        add_scaled(sum.first[axis], bfloat16_to_float(link[l].gradient_to[axis]), from.mean);
      }
    }
  }
  return sum;
}

}  // namespace rebounce
