#include "runtime/demo/picture/key_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "runtime/demo/picture/default_view.h"
#include "runtime/rays/box.h"

namespace rebounce {
namespace {

constexpr double kFluxPerArea = 100;  // lm/m²
constexpr std::size_t kCandidates = 128;
constexpr std::size_t kReceivers = 512;  // patches that a candidate may light

// A lamp is close to a surface within this fraction of the scene's diagonal.
constexpr float kCloseness = 0.15F;

// How much it counts to light a surface that sees nothing but sky, where one that sees no sky
// counts 1: the lamp of a building belongs inside, and not above the roof.
constexpr float kOpenAir = 0.05F;

// How much it counts to light what the default camera does not see.
constexpr float kOutOfView = 0.1F;

// `count` patches, evenly distributed over the surface area.
std::vector<std::size_t> spread_patches(const PatchTable& patches, std::size_t count) {
  const double total = std::accumulate(patches.area.begin(), patches.area.end(), 0.0);
  std::vector<std::size_t> chosen;
  double sum = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    sum += patches.area[i];
    const auto due = static_cast<std::size_t>(static_cast<double>(count) * sum / total);
    if (due > chosen.size()) chosen.resize(due, i);
  }
  return chosen;
}

Float3 above(const PatchTable& patches, std::size_t patch, const RayTracer& tracer) {
  return tracer.offset_point(patches.centroid[patch], patches.normal[patch]);
}

// Half way from each patch to the opposite surface, at most `reach` metres.
std::vector<Float3> candidates(const PatchTable& patches, const RayTracer& tracer, float reach) {
  std::vector<Ray> rays;
  for (const std::size_t i : spread_patches(patches, kCandidates)) {
    rays.push_back({.origin = above(patches, i, tracer),
                    .t_near = 0,
                    .direction = patches.normal[i],
                    .t_far = reach});
  }
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  std::vector<Float3> places;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const float way = hits[k].triangle == kNone ? reach : hits[k].t;
    places.push_back(to_float3(to_glm(rays[k].origin) + 0.5F * way * to_glm(rays[k].direction)));
  }
  return places;
}

struct Receiver {
  Float3 point;
  Float3 normal;
  float weight;
};

bool is_in_front(const Camera& camera, const glm::vec3& way) {
  return glm::dot(way, to_glm(camera.backward)) < -std::cos(camera.vertical_fov) * glm::length(way);
}

std::vector<Receiver> key_light_receivers(const TransferData& data, const RayTracer& tracer) {
  const PatchTable& patches = data.patches;
  const Camera camera = default_camera(data, tracer);
  std::vector<Receiver> receivers;
  for (const std::size_t i : spread_patches(patches, kReceivers)) {
    const Float3 point = above(patches, i, tracer);
    const glm::vec3 way = to_glm(point) - to_glm(camera.position);
    Ray ray{.origin = point, .t_near = 0, .direction = to_float3(-way), .t_far = 1};
    tracer.occluded({&ray, 1});
    const bool seen = is_in_front(camera, way) && !is_occluded(ray);
    const float shelter = 1 - (1 - kOpenAir) * patches.sky_visibility[i];
    receivers.push_back({point, patches.normal[i], shelter * (seen ? 1 : kOutOfView)});
  }
  return receivers;
}

// The weights of the `receivers` that see `place`, times the distance to the nearest of them, at
// most `reach`.
float merit(const Float3& place, std::span<const Receiver> receivers, const RayTracer& tracer,
            float reach) {
  std::vector<Ray> rays;
  std::vector<float> weights;
  for (const Receiver& receiver : receivers) {
    const glm::vec3 way = to_glm(place) - to_glm(receiver.point);
    if (glm::dot(way, to_glm(receiver.normal)) <= 0) continue;
    rays.push_back(
        {.origin = receiver.point, .t_near = 0, .direction = to_float3(way), .t_far = 1});
    weights.push_back(receiver.weight);
  }
  tracer.occluded(rays);
  float reached = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    if (is_occluded(rays[k])) continue;
    reached += weights[k];
    reach = std::min(reach, glm::length(to_glm(rays[k].direction)));
  }
  return reach * reached;
}

}  // namespace

Light make_key_light(const TransferData& data, const RayTracer& tracer) {
  const PatchTable& patches = data.patches;
  const float size = glm::length(box_around(patches.centroid).extent());
  const std::vector<Receiver> receivers = key_light_receivers(data, tracer);
  const double area = std::accumulate(patches.area.begin(), patches.area.end(), 0.0);
  Light light;
  light.name = "key light";
  light.intensity = static_cast<float>(kFluxPerArea * area / (4 * std::numbers::pi));
  float best = -1;
  for (const Float3& place : candidates(patches, tracer, 0.5F * size)) {
    const float value = merit(place, receivers, tracer, kCloseness * size);
    if (value <= best) continue;
    best = value;
    light.position = place;
  }
  return light;
}

}  // namespace rebounce
