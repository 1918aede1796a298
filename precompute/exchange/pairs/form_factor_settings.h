#pragma once

#include <cstdint>

namespace rebounce {

struct FormFactorSettings {
  std::uint64_t seed = 1;  ///< of the sample points; every seed gives an equally good F
  /// Shadow rays that each pair of patches gets first, at most 256. If they agree, the pair gets no
  /// more. More rays notice partly hidden pairs more often.
  int probe_rays = 8;
  /// Shadow rays for a pair that is partly hidden, at most 256; a pair that exchanges much light
  /// gets six times as many. More rays make penumbrae smoother and take longer.
  int full_rays = 64;
  /// Rays per patch into its hemisphere. They measure the light that escapes and the exchange of
  /// near patches of many triangles, and they find pairs that probe rays misjudge. More rays
  /// improve row sums in open scenes and reduce noise between near patches.
  int hemisphere_rays = 4096;
  /// Relative error that the unoccluded kernel aims at.
  double kernel_tolerance = 3e-4;
  /// Only for links (links.h), where it must be above 0: the largest error of a link. It is an
  /// absolute error, in the Frobenius norm, of the part of A^1/2 F A^-1/2 that the link stands for.
  /// Smaller values give smaller sets and more links.
  double link_epsilon = 0;
};

/// How exact form factors are, and how long they take.
enum class FormFactorQuality : std::uint8_t {
  kLow,      ///< for a first look: about three times as fast
  kDefault,  ///< view factors agree with closed forms to 0.5 %
  kHigh,     ///< to 0.1 %: about ten times slower
};

/// `settings` with the values of a quality; seed and links stay.
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
