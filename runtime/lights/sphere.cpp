// A sphere of uniform luminance. Form factor, also where the horizon cuts the sphere: J. R. Howell,
// "A catalog of radiation heat transfer configuration factors", B-43. Sample points: C. Wang,
// "Direct lighting models for ray tracing with cylindrical lamps", 1992,
// with the square taken to the cone by way of a disc.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::sphere_lamp {
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

// The cases that need no arc.
void form_factors(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                  PartValues& factor) {
  const glm::vec3 middle = lamp.position;
  const float radius = lamp.radius;
  const std::size_t begin = part * UnitLightBlock::kPart;
#pragma omp simd
  for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
    const std::size_t k = begin + e;
    const PathFromPoint to_center(middle, points, k);
    const float height = to_center.height(points, k);
    const float distance_squared = to_center.squared();
    const float whole = radius * radius * height / (distance_squared * std::sqrt(distance_squared));
    const bool outside = distance_squared > radius * radius;
    const float other = outside & (height <= -radius) ? 0.0F : -1.0F;
    factor[e] = outside & (height >= radius) ? whole : other;
  }
}

/// Two directions across the unit vector (x, y, z) and each other (T. Duff et al., "Building an
/// orthonormal basis, revisited", 2017).
struct Across {
  float first_x, first_y, first_z, second_x, second_y, second_z;

  Across(float x, float y, float z) {
    const float sign = std::copysign(1.0F, z), a = -1 / (sign + z), b = x * y * a;
    first_x = 1 + sign * x * x * a;
    first_y = sign * b;
    first_z = -sign * x;
    second_x = b;
    second_y = sign + y * y * a;
    second_z = -y;
  }
};

/// The cone that a sphere subtends, seen from outside of it.
struct Cone {
  float radius_squared, distance_squared, distance;
  float height;  ///< 1 - cosine of its half angle, without cancellation

  Cone(float of_radius_squared, float of_distance_squared)
      : radius_squared(of_radius_squared), distance_squared(of_distance_squared) {
    const float sine_squared = radius_squared / distance_squared;
    distance = std::sqrt(distance_squared);
    height = sine_squared / (1 + std::sqrt(std::max(0.0F, 1 - sine_squared)));
  }
};

/// A direction in a cone, uniformly for (u, v) in the unit square, and the way to the sphere.
struct DirectionInCone {
  float cosine;         ///< of the angle to the axis
  float first, second;  ///< along Across
  float distance;

  DirectionInCone(const Cone& cone, float u, float v) {
    float x = 0, y = 0;
    square_to_disc(u, v, x, y);
    const float down = (x * x + y * y) * cone.height;
    cosine = 1 - down;
    const float sine_part = std::sqrt(cone.height * (2 - down));
    first = sine_part * x;
    second = sine_part * y;
    const float off_axis_squared = cone.distance_squared * down * (2 - down);
    distance =
        cone.distance * cosine - std::sqrt(std::max(0.0F, cone.radius_squared - off_axis_squared));
  }
};

void evaluate_places(const PreparedLight& lamp, const glm::vec3& point,
                     std::span<const glm::vec2> places, std::span<UnitLight> light) {
  const glm::vec3 to_center = lamp.position - point;
  const Cone cone(lamp.radius * lamp.radius, glm::dot(to_center, to_center));
  if (!(cone.radius_squared < cone.distance_squared)) {  // inside
    std::ranges::fill(light, UnitLight{});
    return;
  }
  const float illuminance = 2 * kPi * cone.height * lamp.range_window(cone.distance_squared);
  const glm::vec3 axis = to_center / cone.distance;
  const Across across(axis.x, axis.y, axis.z);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const DirectionInCone way(cone, places[k].x, places[k].y);
    light[k] = {way.cosine * axis +
                    way.first * glm::vec3(across.first_x, across.first_y, across.first_z) +
                    way.second * glm::vec3(across.second_x, across.second_y, across.second_z),
                way.distance, illuminance};
  }
}

void places_of_part(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    const PartValues& u, const PartValues& v, PlacesOfPart& places) {
  const glm::vec3 middle = lamp.position;
  const float radius_squared = lamp.radius * lamp.radius;
  const std::size_t begin = part * UnitLightBlock::kPart;
#pragma omp simd
  for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
    const std::size_t k = begin + e;
    const PathFromPoint to_center(middle, points, k);
    const Cone cone(radius_squared, to_center.squared());
    const DirectionInCone way(cone, u[e], v[e]);
    const float axis_x = to_center.x / cone.distance, axis_y = to_center.y / cone.distance,
                axis_z = to_center.z / cone.distance;
    const Across across(axis_x, axis_y, axis_z);
    const float x = way.cosine * axis_x + way.first * across.first_x + way.second * across.second_x;
    const float y = way.cosine * axis_y + way.first * across.first_y + way.second * across.second_y;
    const float z = way.cosine * axis_z + way.first * across.first_z + way.second * across.second_z;
    places.path[0][e] = way.distance * x;
    places.path[1][e] = way.distance * y;
    places.path[2][e] = way.distance * z;
    const float height =
        x * points.normal[0][k] + y * points.normal[1][k] + z * points.normal[2][k];
    const bool outside = radius_squared < cone.distance_squared;
    places.weight[e] = outside ? std::max(0.0F, height) : 0.0F;
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
                               .places_of_part = places_of_part,
                               .form_factor = form_factor,
                               .form_factors = form_factors,
                               .highest_point = highest_point,
                               .place = place,
                               .mesh = mesh,
                               .candela = candela,
                               .punctual = LightType::kPoint};

}  // namespace

extern const LampKind kKind;
constinit const LampKind kKind{.type = LightType::kSphere,
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

}  // namespace rebounce::sphere_lamp
