#pragma once

#include <cstdint>

namespace rebounce {

struct FormFactorSettings {
  std::uint64_t seed = 1;  ///< of the sample points; another seed is another, equally good F
  /// Shadow rays for a pair of patches to begin with; if they agree that is all. More: partly
  /// hidden pairs are noticed more often. At most 256.
  int probe_rays = 8;
  /// Shadow rays for a pair that is partly hidden; one that exchanges much gets six times as many.
  /// More: smoother penumbrae, slower. At most 256.
  int full_rays = 64;
  /// Rays per patch into its hemisphere. They measure what escapes, and what near patches of many
  /// triangles exchange; they find the pairs that probe rays misjudge. More: better row sums in
  /// open scenes, less noise between near patches.
  int hemisphere_rays = 4096;
  /// Relative error aimed at by the unoccluded kernel.
  double kernel_tolerance = 3e-4;
  /// Of links alone (links.h), for which it is above 0: the error that a link may have, of the part
  /// of the symmetric form A^1/2 F A^-1/2 that it stands for, Frobenius, absolute. Smaller: smaller
  /// sets, more links.
  double link_epsilon = 0;
};

/// How much work form factors are worth.
enum class FormFactorQuality : std::uint8_t {
  kLow,      ///< for a first look: some three times as fast
  kDefault,  ///< analytic view factors to 0.5 %
  kHigh,     ///< to 0.1 %: some ten times slower
};

/// `settings` with what a quality decides; seed and links stay.
///
/// | quality | probe_rays | full_rays | hemisphere_rays | kernel_tolerance |
/// |---|---|---|---|---|
/// | low | 4 | 16 | 1024 | 3e-3 |
/// | default | 8 | 64 | 4096 | 3e-4 |
/// | high | 32 | 256 | 65536 | 1e-5 |
FormFactorSettings with_quality(FormFactorQuality quality, FormFactorSettings settings = {});

/// Throws Error if a setting is out of range.
void check_form_factor_settings(const FormFactorSettings& settings);

}  // namespace rebounce
