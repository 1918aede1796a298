#include "bench/support/light_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "precompute/lights/random_lights.h"
#include "rebounce/error.h"
#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"

namespace rebounce::bench {
namespace {

/// Two places for a lamp, far enough from each other that it can move between them, and free to.
std::pair<Light, Light> find_places(const TransferData& data, const RayTracer& tracer,
                                    double distance, std::uint64_t seed) {
  constexpr int kTries = 64;
  const std::vector<Light> lamps = lamps_in_the_open(data, tracer, kTries, seed);
  for (const Light& lamp : lamps) {
    for (const Light& other : lamps) {
      if (glm::distance(to_dvec3(lamp.position), to_dvec3(other.position)) > distance &&
          free_way(tracer, lamp.position, other.position)) {
        return {lamp, other};
      }
    }
  }
  throw Error("the scene has no room to move a lamp in; give another");
}

Light moved(Light lamp, const Light& towards, double distance) {
  const glm::dvec3 from = to_dvec3(lamp.position);
  const glm::dvec3 direction = glm::normalize(to_dvec3(towards.position) - from);
  lamp.position = to_float3(from + distance * direction);
  return lamp;
}

/// The part of the surface's area that `irradiance` [n] reaches.
double lit_part(const TransferData& data, std::span<const Float3> irradiance) {
  double lit = 0, all = 0;
  for (std::size_t i = 0; i < irradiance.size(); ++i) {
    all += data.patches.area[i];
    if (irradiance[i][0] > 0) lit += data.patches.area[i];
  }
  return lit / all;
}

/// M0 [n] in lx under one lamp.
std::vector<Float3> exitance_under(const Light& lamp, const TransferData& data,
                                   DirectLighting& direct) {
  std::vector<Float3> exitance(data.patches.size());
  direct.compute({&lamp, 1}, {}, exitance);
  reflect(data.patches.reflectance, exitance);
  return exitance;
}

/// The part of the light that patches give off first which arrives at other patches: 0 if they give
/// off none.
double arriving_part(const PatchTable& patches, std::span<const Float3> exitance) {
  double arriving = 0, all = 0;
  for (std::size_t i = 0; i < exitance.size(); ++i) {
    const auto& [red, green, blue] = exitance[i];
    const double light = static_cast<double>(patches.area[i]) * (red + green + blue);
    arriving += light * (1 - patches.sky_visibility[i] - patches.absorbed[i]);
    all += light;
  }
  return all > 0 ? arriving / all : 0;
}

std::vector<LightChange> draw_changes(const TransferData& data, const RayTracer& tracer,
                                      std::span<const double> motions, std::uint64_t seed,
                                      LightType type) {
  DirectLighting direct(data, tracer);
  const double size = box_around(data.mesh.position).diagonal();
  const auto [place, other] = find_places(data, tracer, 0.2 * size, seed);
  const Float3& target = data.patches.centroid[mix_bits(seed) % data.patches.size()];
  const auto light_at = [&](const Light& there) {
    return exitance_under(lamp_of_type(type, there, target, size), data, direct);
  };
  const std::vector<Float3> before = light_at(place);
  std::vector<LightChange> changes = {{"from zero", {}, before}};
  for (const double part : motions) {
    changes.push_back({fmt::format("moved {:g} %", 100 * part), before,
                       light_at(moved(place, other, part * size))});
  }
  changes.push_back({kSwitched, before, light_at(other)});
  return changes;
}

}  // namespace

std::vector<Float3> light_of(const Light& lamp, const TransferData& data, DirectLighting& direct) {
  std::vector<Float3> exitance = exitance_under(lamp, data, direct);
  if (area_norm(exitance, data.patches.area) == 0) {
    throw Error("the test lamp lights nothing; the scene must have lit patches that reflect");
  }
  return exitance;
}

std::vector<Light> lamps_in_the_open(const TransferData& data, const RayTracer& tracer, int count,
                                     std::uint64_t seed) {
  constexpr double kLeastLit = 0.05;
  DirectLighting direct(data, tracer);
  std::vector<Float3> irradiance(data.patches.size());
  std::vector<Light> lamps = random_point_lights(data, tracer, count, seed);
  std::erase_if(lamps, [&](const Light& lamp) {
    direct.compute({&lamp, 1}, {}, irradiance);
    return lit_part(data, irradiance) < kLeastLit;
  });
  if (lamps.empty()) throw Error("no lamp at any place lights much of the scene; give another");
  return lamps;
}

bool free_way(const RayTracer& tracer, const Float3& from, const Float3& to) {
  std::array<Ray, 1> ray = {{{.origin = from,
                              .t_near = 0,
                              .direction = to_float3(to_glm(to) - to_glm(from)),
                              .t_far = 1}}};
  tracer.occluded(ray);
  return !is_occluded(ray[0]);
}

Light lamp_of_type(LightType type, const Light& place, const Float3& target, double diagonal) {
  constexpr double kRadius = 0.005, kLength = 0.02, kWidth = 0.01;  // of the diagonal
  constexpr float kInnerCone = 0.35F, kOuterCone = 0.7F;            // radians
  Light lamp = place;
  lamp.type = type;
  const glm::dvec3 way = to_dvec3(target) - to_dvec3(place.position);
  if (glm::length(way) > 0) lamp.direction = to_float3(glm::normalize(way));
  lamp.tangent = std::abs(lamp.direction[0]) < 0.8F ? Float3{1, 0, 0} : Float3{0, 1, 0};
  lamp.inner_cone_angle = kInnerCone;
  lamp.outer_cone_angle = kOuterCone;
  lamp.radius = static_cast<float>(kRadius * diagonal);
  lamp.size = {static_cast<float>(kLength * diagonal), static_cast<float>(kWidth * diagonal)};
  if (type == LightType::kRectangle) lamp.intensity /= lamp.size[0] * lamp.size[1];
  if (type == LightType::kSphere || type == LightType::kDisc) {
    lamp.intensity /= std::numbers::pi_v<float> * lamp.radius * lamp.radius;
  }
  return lamp;
}

std::vector<LightChange> light_changes(const TransferData& data, std::span<const double> motions,
                                       std::uint64_t seed, LightType type) {
  constexpr double kLeastArriving = 0.1;
  constexpr int kTries = 64;
  const RayTracer tracer = make_surface_tracer(data.mesh);
  for (int k = 0; k < kTries; ++k, seed = mix_bits(seed)) {
    std::vector<LightChange> changes = draw_changes(data, tracer, motions, seed, type);
    const bool arrives = std::ranges::all_of(changes, [&](const LightChange& change) {
      return arriving_part(data.patches, change.after) >= kLeastArriving;
    });
    if (arrives) return changes;
  }
  throw Error("no lamp lights much that other surfaces see; give another scene");
}

}  // namespace rebounce::bench
