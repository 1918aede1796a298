#pragma once

#include <cstdint>
#include <span>

namespace rebounce {

struct LinkSettings {
  /// Error that a link may have: of the part of the symmetric form A^1/2 F A^-1/2 that it stands
  /// for, Frobenius, absolute. Smaller: more links, of smaller nodes; 0: every pair of patches.
  double epsilon = 1e-4;
  std::uint64_t seed = 1;  ///< of the sample points
  int probe_rays = 8;      ///< of a pair to begin with, at most 64
  int full_rays = 64;      ///< of a pair that is partly hidden, at most 64
  double kernel_tolerance = 3e-4;  ///< of the unoccluded kernel between patches
  /// [n] what errors in the light from a patch weigh, for instance its radiosity divided by the
  /// mean ("BF refinement"); empty: 1.
  std::span<const float> weight = {};
};

}  // namespace rebounce
