// The cone of KHR_lights_punctual, "Inner and Outer Cone Angles".

#include <algorithm>
#include <cmath>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::spot_lamp {
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

// The same operations, vectorised.
void evaluate_block(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    UnitLightBlock& light) {
  inverse_square(lamp, points, part, light);
  const glm::vec3 axis = lamp.direction;
  const float cone_cosine = lamp.cone_cosine, cone_scale = lamp.cone_scale;
  const std::size_t begin = part * UnitLightBlock::kPart;
  const auto &x = light.direction[0], &y = light.direction[1], &z = light.direction[2];
#pragma omp simd
  for (std::size_t k = begin; k < begin + UnitLightBlock::kPart; ++k) {
    const float cosine = -(x[k] * axis.x + y[k] * axis.y + z[k] * axis.z);
    const float inside = std::min(std::max(0.0F, (cosine - cone_cosine) * cone_scale), 1.0F);
    light.illuminance[k] *= inside * inside;
  }
  apply_profile(lamp, part, light);
}

// The ball is outside the cone if its centre is farther from the axis than the cone's half angle
// and the half angle that the ball fills.
bool may_reach(const PreparedLight& lamp, const glm::vec3& centre, float radius) {
  constexpr float kRounding = 1e-4F;
  const glm::vec3 path = centre - lamp.position;
  const float distance = glm::length(path), sine_of_ball = radius / distance;
  if (!(sine_of_ball < 1)) return true;
  const float cosine_of_ball = std::sqrt(1 - sine_of_ball * sine_of_ball);
  const float sine_of_cone = std::sqrt(std::max(0.0F, 1 - lamp.cone_cosine * lamp.cone_cosine));
  const float least_cosine = lamp.cone_cosine * cosine_of_ball - sine_of_cone * sine_of_ball;
  return glm::dot(path, lamp.direction) / distance > least_cosine - kRounding;
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

extern const LampKind kKind;
constinit const LampKind kKind{.type = LightType::kSpot,
                               .name = "spot",
                               .plural = "spots",
                               .unit = "cd",
                               .fields = kFields,
                               .shadow_map = ShadowMapKind::kCube,
                               .prepare = prepare,
                               .evaluate = evaluate,
                               .evaluate_block = evaluate_block,
                               .surface = nullptr,
                               .may_reach = may_reach,
                               .glsl = kGlsl};

}  // namespace rebounce::spot_lamp
