#include "runtime/lights/light_sampling.h"

#include <algorithm>
#include <cmath>

#include "rebounce/error.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {

bool is_area_light(LightType type) {
  return lamp_kind(type).surface != nullptr;
}

IncidentLight evaluate_light(const Light& light, const Float3& point, const Float2& place) {
  const PreparedLight prepared(light);
  UnitLight unit;
  if (prepared.has_area()) {
    const glm::vec2 from = to_glm(place);
    prepared.evaluate_places(to_glm(point), {&from, 1}, {&unit, 1});
  } else {
    unit = prepared.evaluate(to_glm(point));
  }
  return {.direction = to_float3(unit.direction),
          .distance = unit.distance,
          .illuminance = to_float3(to_glm(light.color) * light.intensity * unit.illuminance)};
}

void check_light(const Light& light) {
  const LampKind& kind = lamp_kind(light.type);
  for (const LampField* field : {&kPosition, &kColor, &kIntensity, &kRange}) {
    check_field(light, *field);
  }
  for (const LampField* field : kind.fields) check_field(light, *field);
  if (!std::isfinite(light.intensity * std::ranges::max(light.color))) {
    throw Error("a light's intensity times its color must be finite");
  }
  if (!light.profile || !kind.uses(kProfile)) return;
  check_field(light, kDirection);
  check_field(light, kTangent);
}

}  // namespace rebounce
