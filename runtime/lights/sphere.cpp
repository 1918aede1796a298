// A sphere of uniform luminance. Form factor, also where the horizon cuts the sphere: J. R. Howell,
// "A catalog of radiation heat transfer configuration factors", B-43. Sample points: C. Wang,
// "Direct lighting models for ray tracing with cylindrical lamps", 1992.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

static_assert(static_cast<int>(LightType::kSphere) == REBOUNCE_LIGHT_SPHERE);

constexpr const LampField* kFields[] = {&kPosition, &kColor, &kIntensity, &kRange, &kRadius};

void prepare(const Light& light, PreparedLight& lamp) {
  lamp.radius = light.radius;
  lamp.area = 4 * kPi * lamp.radius * lamp.radius;
}

/// The form factor of a sphere that the horizon cuts. `sine_squared`: of the half angle that the
/// sphere subtends; `cosine`: of the angle between the normal and its centre.
double cut_sphere(double sine_squared, double cosine) {
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double cotangent_of_half = std::sqrt(1 / sine_squared - 1);
  const double cosine_of_half = std::sqrt(1 - sine_squared);
  const double across = std::sqrt(std::max(0.0, 1 - cosine * cosine / sine_squared));
  const double turn = std::acos(std::clamp(-cotangent_of_half * cosine / sine, -1.0, 1.0));
  const double lens = std::asin(std::clamp(cosine_of_half / sine, -1.0, 1.0));
  return 0.5 +
         (sine_squared * (cosine * turn - cotangent_of_half * across) - lens) / std::numbers::pi;
}

// 1 inside the sphere.
float form_factor(const PreparedLight& lamp, const glm::vec3& point, const glm::vec3& normal) {
  const glm::vec3 to_center = lamp.position - point;
  const float radius = lamp.radius;
  const float distance_squared = glm::dot(to_center, to_center);
  const float sine_squared = radius * radius / distance_squared;
  if (!(sine_squared < 1)) return 1;
  const float height = glm::dot(to_center, normal);
  if (height <= -radius) return 0;
  const float cosine = height / std::sqrt(distance_squared);
  if (height >= radius) return sine_squared * cosine;
  return std::max(0.0F, static_cast<float>(cut_sphere(sine_squared, cosine)));
}

// Uniformly in the cone that the sphere subtends.
void evaluate_places(const PreparedLight& lamp, const glm::vec3& point,
                     std::span<const glm::vec2> places, std::span<UnitLight> light) {
  const glm::vec3 to_center = lamp.position - point;
  const float distance_squared = glm::dot(to_center, to_center);
  const float radius_squared = lamp.radius * lamp.radius;
  const float sine_squared = radius_squared / distance_squared;
  if (!(sine_squared < 1)) {  // inside
    std::ranges::fill(light, UnitLight{});
    return;
  }
  const float distance = std::sqrt(distance_squared);
  // 1 - cos of the cone's half angle, without cancellation.
  const float height = sine_squared / (1 + std::sqrt(1 - sine_squared));
  const float illuminance = 2 * kPi * height * lamp.range_window(distance_squared);
  const glm::vec3 axis = to_center / distance;
  const auto [x, y] = sides_around(axis, least_axis(axis));
  for (std::size_t k = 0; k < places.size(); ++k) {
    const float down = places[k].x * height;  // 1 - cosine of the angle to the axis
    const float cosine = 1 - down, sine_squared_here = down * (1 + cosine);
    const float sine = std::sqrt(sine_squared_here), turn = 2 * kPi * places[k].y;
    // The first intersection with the sphere.
    const float off_axis_squared = distance_squared * sine_squared_here;
    const float into = std::sqrt(std::max(0.0F, radius_squared - off_axis_squared));
    light[k] = {cosine * axis + sine * (std::cos(turn) * x + std::sin(turn) * y),
                distance * cosine - into, illuminance};
  }
}

glm::vec3 highest_point(const PreparedLight& lamp, const glm::vec3& normal) {
  return lamp.position + lamp.radius * normal;
}

glm::vec3 place(const PreparedLight& lamp, std::uint32_t k, std::uint32_t count) {
  const float height = 1 - 2 * (static_cast<float>(k) + 0.5F) / static_cast<float>(count);
  const float r = std::sqrt(1 - height * height);
  const glm::vec2 around = golden_turn(k);
  return lamp.radius * glm::vec3(r * around.x, height, r * around.y);
}

LampMesh mesh(const PreparedLight& lamp) {
  LampMesh sphere = unit_sphere();
  for (Float3& v : sphere.position) v = to_float3(lamp.position + lamp.radius * to_glm(v));
  return sphere;
}

float candela(const PreparedLight& lamp) {
  return kPi * lamp.radius * lamp.radius;
}

// The form factor, with arcs as arc tangents: OpenGL's arc sines are imprecise.
constexpr const char* kGlsl = R"(
float sphere_irradiance(vec3 to_center, vec3 direction, vec3 normal) {
  float sine_squared = lamp_radius * lamp_radius / dot(to_center, to_center);
  float height = dot(to_center, normal);
  if (sine_squared >= 1) return kPi;
  if (height <= -lamp_radius) return 0.0;
  float cosine = height / length(to_center);
  if (height >= lamp_radius) return kPi * (sine_squared * cosine);
  float cotangent = sqrt(1 / sine_squared - 1);
  float rim = sqrt(max(0.0, 1 - cosine * cosine / sine_squared));
  float turn = atan(rim, -cotangent * cosine);
  float lens = atan(sqrt(sine_squared) * rim, sqrt(1 - sine_squared));
  return kPi * max(0.0, (sine_squared * (cosine * turn - cotangent * rim) + lens) / kPi);
}

vec3 sphere_normal(vec3 place) { return place / lamp_radius; }
)";

constexpr LampSurface kSurface{.evaluate_places = evaluate_places,
                               .form_factor = form_factor,
                               .highest_point = highest_point,
                               .place = place,
                               .mesh = mesh,
                               .candela = candela,
                               .punctual = LightType::kPoint};

}  // namespace

extern const LampKind kSphereLamp;
constinit const LampKind kSphereLamp{.type = LightType::kSphere,
                                     .name = "sphere",
                                     .plural = "spheres",
                                     .unit = "cd/m2",
                                     .fields = kFields,
                                     .shadow_map = ShadowMapKind::kPlaces,
                                     .prepare = prepare,
                                     .evaluate = nullptr,
                                     .evaluate_block = nullptr,
                                     .surface = &kSurface,
                                     .glsl = kGlsl};

}  // namespace rebounce
