#include <limits>

#include "rebounce.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::directional_lamp {
namespace {

static_assert(static_cast<int>(LightType::kDirectional) == REBOUNCE_LIGHT_DIRECTIONAL);

constexpr const LampField* kFields[] = {&kDirection, &kColor, &kIntensity};

void prepare(const Light& light, PreparedLight& lamp) {
  lamp.direction = to_glm(light.direction);
}

UnitLight evaluate(const PreparedLight& lamp, const glm::vec3&) {
  return {-lamp.direction, std::numeric_limits<float>::infinity(), 1};
}

void evaluate_block(const PreparedLight& lamp, const PatchPointBlock&, std::size_t part,
                    UnitLightBlock& light) {
  const std::size_t begin = part * UnitLightBlock::kPart;
  const UnitLight everywhere = evaluate(lamp, {});
  for (std::size_t k = begin; k < begin + UnitLightBlock::kPart; ++k) light.set(k, everywhere);
}

constexpr const char* kGlsl = R"(
float directional_irradiance(vec3 to_lamp, vec3 direction, vec3 normal) {
  return max(0.0, dot(normal, direction));
}
)";

}  // namespace

extern const LampKind kKind;
constinit const LampKind kKind{.type = LightType::kDirectional,
                               .name = "directional",
                               .plural = "directional lights",
                               .unit = "lx",
                               .fields = kFields,
                               .shadow_map = ShadowMapKind::kPlane,
                               .prepare = prepare,
                               .evaluate = evaluate,
                               .evaluate_block = evaluate_block,
                               .surface = nullptr,
                               .glsl = kGlsl};

}  // namespace rebounce::directional_lamp
