// The cone of KHR_lights_punctual, "Inner and Outer Cone Angles".

#include <algorithm>
#include <cmath>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

static_assert(static_cast<int>(LightType::kSpot) == REBOUNCE_LIGHT_SPOT);

constexpr const LampField* kFields[] = {&kPosition, &kDirection, &kColor,  &kIntensity,
                                        &kRange,    &kCone,      &kProfile};

void prepare(const Light& light, PreparedLight& lamp) {
  lamp.direction = to_glm(light.direction);
  lamp.cone_cosine = std::cos(light.outer_cone_angle);
  lamp.cone_scale = 1 / std::max(0.001F, std::cos(light.inner_cone_angle) - lamp.cone_cosine);
  prepare_profile(light, lamp);
}

UnitLight evaluate(const PreparedLight& lamp, const glm::vec3& point) {
  UnitLight light = inverse_square(lamp, point);
  const float cosine = -glm::dot(light.direction, lamp.direction);
  const float inside = std::clamp((cosine - lamp.cone_cosine) * lamp.cone_scale, 0.0F, 1.0F);
  light.illuminance *= inside * inside;
  apply_profile(lamp, light);
  return light;
}

constexpr const char* kGlsl = R"(
float spot_irradiance(vec3 to_lamp, vec3 direction, vec3 normal) {
  float strength = max(0.0, dot(normal, direction)) / max(dot(to_lamp, to_lamp), 1e-12);
  float inside = (dot(-direction, lamp_direction) - cos_outer) / max(0.001, cos_inner - cos_outer);
  inside = clamp(inside, 0.0, 1.0);
  return strength * (inside * inside);
}
)";

}  // namespace

extern const LampKind kSpotLamp;
constinit const LampKind kSpotLamp{.type = LightType::kSpot,
                                   .name = "spot",
                                   .plural = "spots",
                                   .unit = "cd",
                                   .fields = kFields,
                                   .shadow_map = ShadowMapKind::kCube,
                                   .prepare = prepare,
                                   .evaluate = evaluate,
                                   .surface = nullptr,
                                   .glsl = kGlsl};

}  // namespace rebounce
