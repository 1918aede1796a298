// A one-sided rectangle of uniform luminance, sampled by area.

#include <array>
#include <cmath>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/polygon_form_factor.h"

namespace rebounce {
namespace {

static_assert(static_cast<int>(LightType::kRectangle) == REBOUNCE_LIGHT_RECTANGLE);

constexpr const LampField* kFields[] = {&kPosition, &kDirection, &kColor,  &kIntensity,
                                        &kRange,    &kSize,      &kTangent};

// In order, in units of the sides.
constexpr std::array kCorners = {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1),
                                 glm::vec2(-1, 1)};

void prepare(const Light& light, PreparedLight& lamp) {
  lamp.direction = to_glm(light.direction);
  const auto [side, other_side] = sides_around(lamp.direction, to_glm(light.tangent));
  lamp.side = side * (0.5F * light.size[0]);
  lamp.other_side = other_side * (0.5F * light.size[1]);
  lamp.area = light.size[0] * light.size[1];
}

void evaluate_places(const PreparedLight& lamp, const glm::vec3& point,
                     std::span<const glm::vec2> places, std::span<UnitLight> light) {
  const glm::vec3 to_center = lamp.position - point;
  const float area = lamp.area * lamp.range_window(glm::dot(to_center, to_center));
  for (std::size_t k = 0; k < places.size(); ++k) {
    light[k] = from_flat_place(lamp, to_center, area, 2.0F * places[k] - glm::vec2(1));
  }
}

float form_factor(const PreparedLight& lamp, const glm::vec3& point, const glm::vec3& normal) {
  if (glm::dot(lamp.position - point, lamp.direction) >= 0) return 0;  // behind the rectangle
  std::array<glm::vec3, 4> corner;
  for (std::size_t k = 0; k < 4; ++k) {
    corner[k] = lamp.position + kCorners[k].x * lamp.side + kCorners[k].y * lamp.other_side;
  }
  return point_to_polygon_form_factor(point, normal, corner);
}

glm::vec3 highest_point(const PreparedLight& lamp, const glm::vec3& normal) {
  const float up = std::copysign(1.0F, glm::dot(lamp.side, normal));
  const float other_up = std::copysign(1.0F, glm::dot(lamp.other_side, normal));
  return lamp.position + up * lamp.side + other_up * lamp.other_side;
}

glm::vec3 place(const PreparedLight& lamp, std::uint32_t k, std::uint32_t) {
  // The R2 sequence (M. Roberts, 2018), starting at the centre.
  const glm::dvec2 at =
      0.5 + static_cast<double>(k) * glm::dvec2(0.7548776662466927, 0.5698402909980532);
  return from_middle(lamp, 2.0F * glm::vec2(glm::fract(at)) - 1.0F);
}

LampMesh mesh(const PreparedLight& lamp) {
  return flat_mesh(lamp, kCorners);
}

float candela(const PreparedLight& lamp) {
  return lamp.area;
}

constexpr const char* kGlsl = R"(
float rectangle_irradiance(vec3 to_center, vec3 direction, vec3 normal) {
  return flat_irradiance(to_center, normal, 4);
}

vec3 rectangle_normal(vec3 place) { return lamp_direction; }
)";

constexpr LampSurface kSurface{.evaluate_places = evaluate_places,
                               .form_factor = form_factor,
                               .highest_point = highest_point,
                               .place = place,
                               .mesh = mesh,
                               .candela = candela,
                               .punctual = LightType::kSpot};

}  // namespace

extern const LampKind kRectangleLamp;
constinit const LampKind kRectangleLamp{.type = LightType::kRectangle,
                                        .name = "rectangle",
                                        .plural = "rectangles",
                                        .unit = "cd/m2",
                                        .fields = kFields,
                                        .shadow_map = ShadowMapKind::kPlaces,
                                        .prepare = prepare,
                                        .evaluate = nullptr,
                                        .evaluate_block = nullptr,
                                        .surface = &kSurface,
                                        .glsl = kGlsl,
                                        .shared_glsl = kFlatGlsl};

}  // namespace rebounce
