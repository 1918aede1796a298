#include "runtime/lights/lamp_kind.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <optional>

#include "runtime/rays/float3_glm.h"

// A kind without a case does not compile.
#pragma GCC diagnostic error "-Wswitch"

namespace rebounce {

// Each in a file of its own.
namespace point_lamp {
extern const LampKind kKind;
}
namespace spot_lamp {
extern const LampKind kKind;
}
namespace directional_lamp {
extern const LampKind kKind;
}
namespace sphere_lamp {
extern const LampKind kKind;
}
namespace rectangle_lamp {
extern const LampKind kKind;
}
namespace disc_lamp {
extern const LampKind kKind;
}

namespace {

/// Nothing beyond the last of LightType. Not null: whether an address is null is no constant
/// expression to a compiler that checks for undefined behaviour.
constexpr std::optional<const LampKind*> find(LightType type) {
  switch (type) {
    case LightType::kPoint:
      return &point_lamp::kKind;
    case LightType::kSpot:
      return &spot_lamp::kKind;
    case LightType::kDirectional:
      return &directional_lamp::kKind;
    case LightType::kSphere:
      return &sphere_lamp::kKind;
    case LightType::kRectangle:
      return &rectangle_lamp::kKind;
    case LightType::kDisc:
      return &disc_lamp::kKind;
  }
  return std::nullopt;
}

constexpr std::size_t count_kinds() {
  std::size_t count = 0;
  while (find(static_cast<LightType>(count))) ++count;
  return count;
}

constexpr auto kKinds = [] {
  std::array<const LampKind*, count_kinds()> kinds{};
  for (std::size_t k = 0; k < kinds.size(); ++k) kinds[k] = *find(static_cast<LightType>(k));
  return kinds;
}();

}  // namespace

const LampKind& lamp_kind(LightType type) {
  return *kKinds[static_cast<std::size_t>(type)];
}

std::span<const LampKind* const> lamp_kinds() {
  return kKinds;
}

bool LampKind::uses(const LampField& field) const {
  return std::ranges::find(fields, &field) != fields.end();
}

PreparedLight::PreparedLight(const Light& light)
    : kind(&lamp_kind(light.type)), reach_squared(std::numeric_limits<float>::infinity()) {
  if (kind->has_place()) {
    position = to_glm(light.position);
    range = light.range;
    if (range > 0) reach_squared = range * range;
  }
  kind->prepare(light, *this);
}

bool PreparedLight::has_area() const {
  return kind->surface != nullptr;
}

UnitLight PreparedLight::evaluate(const glm::vec3& point) const {
  return kind->evaluate(*this, point);
}

void PreparedLight::evaluate(const PatchPointBlock& points, std::size_t part,
                             UnitLightBlock& light) const {
  kind->evaluate_block(*this, points, part, light);
}

void PreparedLight::evaluate_places(const glm::vec3& point, std::span<const glm::vec2> places,
                                    std::span<UnitLight> light) const {
  kind->surface->evaluate_places(*this, point, places, light);
}

float PreparedLight::unoccluded_irradiance(const glm::vec3& point, const glm::vec3& normal) const {
  const glm::vec3 to_center = position - point;
  const float window = range_window(glm::dot(to_center, to_center));
  if (window <= 0) return 0;
  return window * std::numbers::pi_v<float> * kind->surface->form_factor(*this, point, normal);
}

void PreparedLight::unoccluded_irradiance(const PatchPointBlock& points, std::size_t part,
                                          PartValues& irradiance) const {
  kind->surface->form_factors(*this, points, part, irradiance);
  const std::size_t begin = part * UnitLightBlock::kPart;
  for (std::size_t e = 0; e < irradiance.size(); ++e) {
    if (irradiance[e] == 0) continue;
    const std::size_t k = begin + e;
    if (irradiance[e] < 0) {
      irradiance[e] = kind->surface->form_factor(*this, points.at(k), points.normal_at(k));
    }
    const glm::vec3 to_center = position - points.at(k);
    irradiance[e] *= std::numbers::pi_v<float> * range_window(glm::dot(to_center, to_center));
  }
}

float PreparedLight::extent() const {
  return has_area() ? radius + glm::length(side) + glm::length(other_side) : 0;
}

glm::vec3 PreparedLight::highest_point(const glm::vec3& normal) const {
  return kind->surface->highest_point(*this, normal);
}

}  // namespace rebounce
