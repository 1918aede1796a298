#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"

namespace rebounce::point_lamp {
namespace {

static_assert(static_cast<int>(LightType::kPoint) == REBOUNCE_LIGHT_POINT);

constexpr const LampField* kFields[] = {&kPosition, &kColor, &kIntensity, &kRange, &kProfile};

UnitLight evaluate(const PreparedLight& lamp, const glm::vec3& point) {
  UnitLight light = inverse_square(lamp, point);
  apply_profile(lamp, light);
  return light;
}

void evaluate_block(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    UnitLightBlock& light) {
  inverse_square(lamp, points, part, light);
  apply_profile(lamp, part, light);
}

constexpr const char* kGlsl = R"(
float point_irradiance(vec3 to_lamp, vec3 direction, vec3 normal) {
  return max(0.0, dot(normal, direction)) / max(dot(to_lamp, to_lamp), 1e-12);
}
)";

}  // namespace

extern const LampKind kKind;
constinit const LampKind kKind{.type = LightType::kPoint,
                               .name = "point",
                               .plural = "points",
                               .unit = "cd",
                               .fields = kFields,
                               .shadow_map = ShadowMapKind::kCube,
                               .prepare = prepare_profile,
                               .evaluate = evaluate,
                               .evaluate_block = evaluate_block,
                               .surface = nullptr,
                               .glsl = kGlsl};

}  // namespace rebounce::point_lamp
