#include "runtime/lights/lamp_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

void require(bool good, std::string_view field, const char* wanted) {
  if (!good) throw Error("a light's " + std::string(field) + " must be " + wanted);
}

bool is_along(const Float3& direction, std::span<const float> values) {
  const glm::vec3 v(values[0], values[1], values[2]);
  return !(glm::length(glm::cross(to_glm(direction), v)) > 1e-6F * glm::length(v));
}

}  // namespace

void check_field(const Light& light, const LampField& field) {
  // The values are only read.
  const std::span<const float> values = field.values(const_cast<Light&>(light));
  const bool finite = std::ranges::all_of(values, [](float x) { return std::isfinite(x); });
  const float least = values.empty() ? 0 : std::ranges::min(values);
  switch (field.rule) {
    case FieldRule::kFinite:
      require(finite, field.name, "finite");
      break;
    case FieldRule::kNotNegative:
      require(finite && least >= 0, field.name, "at least 0");
      break;
    case FieldRule::kLength:
      require(finite && least > 0, field.name, "above 0");
      break;
    case FieldRule::kUnitVector:
      require(std::abs(glm::length(glm::vec3(values[0], values[1], values[2])) - 1) < 1e-3F,
              field.name, "a unit vector");
      break;
    case FieldRule::kAcross:
      require(finite && !is_along(light.direction, values), field.name,
              "a vector that is not along its direction");
      break;
    case FieldRule::kCone:
      require(light.outer_cone_angle <= std::numbers::pi_v<float> / 2, "outer cone angle",
              "at most pi / 2");
      require(light.inner_cone_angle >= 0 && light.inner_cone_angle <= light.outer_cone_angle,
              "inner cone angle", "from 0 to the outer one");
      break;
    case FieldRule::kProfile:
      if (const IntensityProfile* const profile = light.profile.get()) {
        const std::size_t angles = profile->vertical.size() * profile->horizontal.size();
        require(angles > 0 && profile->candela.size() == angles, field.name,
                "a table with a candela for each pair of angles");
      }
      break;
  }
}

}  // namespace rebounce
