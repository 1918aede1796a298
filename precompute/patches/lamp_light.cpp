#include "precompute/patches/lamp_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include "precompute/patches/refinement.h"
#include "precompute/patches/texture_sampling.h"
#include "precompute/patches/triangle_points.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// Places of a lamp with a surface that each point looks at, and points of a triangle that tell
// whether its light varies.
constexpr std::uint32_t kPlaces = 16, kVariancePoints = 16;

// Points of the emitting surfaces, all together.
constexpr std::uint32_t kEmitterPoints = 32;
constexpr int kEmissionSamples = 16;  // of each emitting triangle

// Triangles whose longest edge is at most this number of patch sizes are fine enough.
constexpr double kFinestInLight = 0.15;

// A triangle is fine enough if area times variance of the feature is at most this part of a mean
// patch's area. Distances alone make 1/6 of it in a square patch (lab/130).
constexpr double kDeviation = 0.02;

// A lamp may lie in a surface: features are at most this number of mean patch sizes.
constexpr double kLargestFeature = 1e4;

/// The luminance of a triangle, cd/m², mean over its surface and the channels.
double mean_luminance(const Scene& scene, std::uint32_t t) {
  const Material& material = scene.materials[scene.triangle_material[t]];
  if (material.emitted_luminance == Float3{0, 0, 0}) return 0;
  const Uint3& v = scene.triangle[t];
  const auto of_corners = [&](const std::vector<Float2>& texcoord) {
    return std::array{texcoord[v[0]], texcoord[v[1]], texcoord[v[2]]};
  };
  const auto [red, green, blue] =
      mean_emitted_luminance(scene, material, of_corners(scene.emissive_texcoord),
                             of_corners(scene.base_color_texcoord), kEmissionSamples);
  return (red + green + blue) / kChannelCount;
}

void add_ray(const Float3& point, const glm::vec3& direction, float length, std::uint32_t id,
             std::vector<Ray>& rays) {
  Ray& ray = rays.emplace_back();
  ray.origin = point;
  ray.direction = to_float3(direction);
  ray.t_near = 0;
  ray.t_far = shadow_ray_length(length);
  ray.id = id;
}

}  // namespace

LampLight::LampLight(const Scene& scene, double weight) : scale_(weight) {
  if (!(weight > 0)) return;
  lights_ = scene.lights;
  place_emitters(scene);
}

/// Places points on the emitting triangles, each for the same part of their power.
void LampLight::place_emitters(const Scene& scene) {
  std::vector<double> power_before{0};
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    power_before.push_back(power_before.back() +
                           area_of(corners_of(scene, t)) * mean_luminance(scene, t));
  }
  const double part = power_before.back() / kEmitterPoints;
  if (!(part > 0) || !std::isfinite(part)) return;
  for (std::uint32_t k = 0; k < kEmitterPoints; ++k) {
    const auto after = std::ranges::upper_bound(power_before, (k + 0.5) * part);
    const auto t = static_cast<std::uint32_t>(after - power_before.begin() - 1);
    const TriangleCorners corners = corners_of(scene, t);
    const double luminance = (power_before[t + 1] - power_before[t]) / area_of(corners);
    Emitter& emitter = emitters_.emplace_back();
    emitter.position = point_at(corners, square_to_triangle(r2_point(k, glm::dvec2(0))));
    emitter.normal = front_normal(corners);
    emitter.candela = static_cast<float>(part);
    emitter.near_squared = static_cast<float>(part / luminance);
    emitter.double_sided = scene.materials[scene.triangle_material[t]].double_sided;
  }
}

void LampLight::measure(const Scene& scene, std::span<const TriangleSides> sides,
                        const RayTracer& tracer) {
  std::vector<double> area(sides.size(), 0.0), square(sides.size(), 0.0);
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t t = 0; t < sides.size(); ++t) {
    const TriangleCorners front = corners_of(scene, t), back{front[0], front[2], front[1]};
    const auto add = [&](const TriangleCorners& side) {
      area[t] += area_of(side);
      square[t] += area_of(side) * std::pow(light_on(side, tracer, 1).mean, 2);
    };
    if (sides[t].front == SideKind::kLit) add(front);
    if (sides[t].back == SideKind::kLit) add(back);
  }
  double whole = 0, sum = 0;
  for (std::size_t t = 0; t < sides.size(); ++t) {
    whole += area[t];
    sum += square[t];
  }
  if (sum > 0 && std::isfinite(sum)) {
    scale_ /= std::sqrt(sum / whole);
  } else {
    lights_.clear();
    emitters_.clear();
  }
}

std::vector<std::uint32_t> LampLight::refine(Scene& scene, std::span<const TriangleSides> sides,
                                             const RayTracer& tracer, double patch_size,
                                             std::size_t most_added) const {
  const auto is_coarse = [&](const TriangleCorners& front, std::uint32_t source) {
    if (longest_edge_length(front) <= kFinestInLight * patch_size) return false;
    return area_of(front) * variance_on(front, sides[source], tracer) >
           kDeviation * patch_size * patch_size;
  };
  return refine_where(scene, is_coarse, most_added);
}

double LampLight::feature(const TriangleCorners& front, const RayTracer& tracer,
                          std::uint32_t count) const {
  if (empty()) return 0;
  return std::min(scale_ * light_on(front, tracer, count).mean, kLargestFeature);
}

/// Of the feature, on the side on which it varies more.
double LampLight::variance_on(const TriangleCorners& corners, const TriangleSides& sides,
                              const RayTracer& tracer) const {
  double most = 0;
  if (sides.front == SideKind::kLit) most = light_on(corners, tracer, kVariancePoints).variance;
  if (sides.back == SideKind::kLit) {
    most = std::max(
        most, light_on({corners[0], corners[2], corners[1]}, tracer, kVariancePoints).variance);
  }
  return scale_ * scale_ * most;
}

/// Mean and variance over `count` points, lx.
LampLight::Moments LampLight::light_on(const TriangleCorners& front, const RayTracer& tracer,
                                       std::uint32_t count) const {
  if (area_vector(front) == glm::dvec3(0)) return {};
  const glm::vec3 normal(front_normal(front));
  LightRays rays;
  std::vector<double> light(count, 0.0);
  for (std::uint32_t k = 0; k < count; ++k) {
    const Float3 point = tracer.offset_point(to_float3(point_at(front, triangle_point(k, count))),
                                             to_float3(normal));
    for (const Light& lamp : lights_) add_lamp(lamp, point, normal, k, rays);
    for (const Emitter& emitter : emitters_) add_emitter(emitter, point, normal, k, rays);
  }
  tracer.occluded(rays.ray);
  for (std::size_t k = 0; k < rays.ray.size(); ++k) {
    if (!is_occluded(rays.ray[k])) light[rays.ray[k].id] += rays.illuminance[k];
  }
  Moments moments;
  for (const double e : light) moments.mean += e / count;
  for (const double e : light) moments.variance += (e - moments.mean) * (e - moments.mean) / count;
  return moments;
}

void LampLight::add_lamp(const Light& lamp, const Float3& point, const glm::vec3& normal,
                         std::uint32_t id, LightRays& rays) const {
  const std::uint32_t count = is_area_light(lamp.type) ? kPlaces : 1;
  for (std::uint32_t k = 0; k < count; ++k) {
    const glm::vec2 place(r2_point(k, glm::dvec2(0)));
    const IncidentLight light = evaluate_light(lamp, point, {place.x, place.y});
    const glm::vec3 direction = to_glm(light.direction);
    const auto [r, g, b] = light.illuminance;
    const float arriving = (r + g + b) / kChannelCount * glm::dot(direction, normal);
    if (!(arriving > 0)) continue;
    add_ray(point, direction, light.distance, id, rays.ray);
    rays.illuminance.push_back(arriving / count);
  }
}

void LampLight::add_emitter(const Emitter& emitter, const Float3& point, const glm::vec3& normal,
                            std::uint32_t id, LightRays& rays) const {
  const glm::vec3 way = emitter.position - to_glm(point);
  const float squared = glm::dot(way, way), length = std::sqrt(squared);
  if (!(length > 0)) return;
  float leaving = -glm::dot(way, emitter.normal) / length;
  if (emitter.double_sided) leaving = std::abs(leaving);
  const float cosine = glm::dot(way, normal) / length;
  if (!(leaving > 0) || !(cosine > 0)) return;
  add_ray(point, way / length, length, id, rays.ray);
  rays.illuminance.push_back(emitter.candela * leaving * cosine /
                             std::max(squared, emitter.near_squared));
}

}  // namespace rebounce
