#include "runtime/demo/bake/punctual_light.h"

#include <cmath>
#include <numbers>

#include "rebounce/lights.h"
#include "runtime/lights/lamp_kind.h"

namespace rebounce {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// The mean over all directions, candela.
float mean_intensity(const IntensityProfile& profile) {
  constexpr int kSteps = 90;
  double sum = 0, weights = 0;
  for (int i = 0; i < kSteps; ++i) {
    const float vertical = kPi * (static_cast<float>(i) + 0.5F) / kSteps;
    for (int j = 0; j < kSteps; ++j) {
      const float horizontal = 2 * kPi * (static_cast<float>(j) + 0.5F) / kSteps;
      sum += std::sin(vertical) * profile.intensity(vertical, horizontal);
      weights += std::sin(vertical);
    }
  }
  return static_cast<float>(sum / weights);
}

}  // namespace

Light punctual_equivalent(const Light& light) {
  Light result = light;
  if (const LampSurface* const surface = lamp_kind(light.type).surface) {
    result.type = surface->punctual;
    result.intensity *= surface->candela(PreparedLight(light));
    if (result.type == LightType::kSpot) {
      result.inner_cone_angle = 0;
      result.outer_cone_angle = kPi / 2;
    }
  }
  if (light.profile) {
    result.intensity *= mean_intensity(*light.profile);
    result.profile = nullptr;
  }
  return result;
}

}  // namespace rebounce
