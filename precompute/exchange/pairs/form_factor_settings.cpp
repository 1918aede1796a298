#include "precompute/exchange/pairs/form_factor_settings.h"

#include <algorithm>
#include <string>

#include "precompute/exchange/pairs/shadow_rays.h"
#include "rebounce/error.h"

namespace rebounce {

FormFactorQuality quality_named(std::string_view name) {
  const auto* const named = std::ranges::find(kQualities, name, &NamedQuality::name);
  if (named == kQualities.end()) {
    throw Error("there is no quality \"" + std::string(name) + "\"");
  }
  return named->quality;
}

FormFactorSettings with_quality(FormFactorQuality quality, FormFactorSettings settings) {
  const FormFactorSettings standard;
  settings.probe_rays = standard.probe_rays;
  settings.full_rays = standard.full_rays;
  settings.hemisphere_rays = standard.hemisphere_rays;
  settings.kernel_tolerance = standard.kernel_tolerance;
  if (quality == FormFactorQuality::kLow) {
    settings.probe_rays = 4;
    settings.full_rays = 16;
    settings.hemisphere_rays = 1024;
    settings.kernel_tolerance = 3e-3;
  } else if (quality == FormFactorQuality::kHigh) {
    settings.probe_rays = 32;
    settings.full_rays = 256;
    settings.hemisphere_rays = 65536;
    settings.kernel_tolerance = 1e-5;
  }
  return settings;
}

void check_form_factor_settings(const FormFactorSettings& settings) {
  const auto in_range = [](int rays) {
    return rays >= 1 && rays <= static_cast<int>(ShadowRays::kMostRays);
  };
  if (!in_range(settings.probe_rays) || !in_range(settings.full_rays) ||
      settings.hemisphere_rays < 1) {
    throw Error(
        "form factors: rays per pair must be between 1 and 256, hemisphere rays at least 1");
  }
  if (!(settings.link_epsilon >= 0)) {
    throw Error("form factors: the error of a link must not be negative");
  }
}

}  // namespace rebounce
