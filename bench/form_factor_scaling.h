#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace rebounce::bench {

/// What finding F with links took, from patches to form factors: no import, no operator.
struct ScalingSample {
  std::size_t patch_count = 0;
  double wall_seconds = 0;
  double processor_seconds = 0;  ///< of all threads, which others on the machine disturb less
  std::uint64_t ray_count = 0;
  std::uint64_t entry_count = 0;  ///< links, or pairs of patches that they were expanded to
  double peak_bytes = 0;          ///< of the process so far: go from few patches to many
};

/// What F is kept as.
enum class LinkedForm : std::uint8_t { kLinks, kPairs };

/// Finds F of the scene at `path` with about `patch_count` patches and links of `epsilon`.
ScalingSample measure_scaling(const std::string& path, std::size_t patch_count, double epsilon,
                              LinkedForm form);

/// The exponent x with which processor seconds grow from `few` to `many` as patches^x.
double scaling_exponent(const ScalingSample& few, const ScalingSample& many);

}  // namespace rebounce::bench
