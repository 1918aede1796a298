#include "precompute/cli/moving_sphere.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "precompute/outputs/light_probes.h"
#include "runtime/rays/box.h"

namespace rebounce::cli {
namespace {

// Position, amplitude and largest radius, as fractions of the way through the scene.
constexpr float kPlace = 0.5F, kSwing = 0.3F, kLargestRadius = 0.1F;
constexpr float kApparentRadius = 0.07F;  // as a fraction of the distance from the camera
constexpr float kProbeCount = 600;

/// The distances in metres from `origin` along the unit `direction` at which a ray enters and
/// leaves the box; {0, 0} if it misses the box.
std::array<float, 2> way_through(const Box& box, const glm::vec3& origin,
                                 const glm::vec3& direction) {
  const glm::vec3 a = (box.low - origin) / direction, b = (box.high - origin) / direction;
  const glm::vec3 in = glm::min(a, b), out = glm::max(a, b);
  const float begin = std::max({in.x, in.y, in.z, 0.0F}), end = std::min({out.x, out.y, out.z});
  if (!(begin < end)) return {0, 0};
  return {begin, end};
}

/// The free distance in metres from `origin` along the unit `direction`, at most `most`.
float free_way(const RayTracer& tracer, const glm::vec3& origin, const glm::vec3& direction,
               float most) {
  const std::array ray = {Ray{
      .origin = to_float3(origin), .t_near = 0, .direction = to_float3(direction), .t_far = most}};
  std::array<Hit, 1> hit;
  tracer.intersect(ray, hit);
  return hit[0].triangle == kNone ? most : hit[0].t;
}

}  // namespace

ViewerSphere sphere_ahead(const Camera& camera, const RayTracer& tracer, const TransferData& data) {
  const Box box = box_around(data.mesh.position);
  const glm::vec3 eye = to_glm(camera.position), ahead = -to_glm(camera.backward);
  const auto [begin, end] = way_through(box, eye, ahead);
  // If the camera looks past the scene, the sphere is as far away as the scene is large.
  const float most = end > 0 ? end : glm::length(box.extent());
  const float way = free_way(tracer, eye, ahead, most) - begin;
  const glm::vec3 middle = eye + (begin + kPlace * way) * ahead;
  ViewerSphere sphere{
      .position = to_float3(middle),
      .radius = std::min(kLargestRadius * way, kApparentRadius * glm::distance(eye, middle))};
  const auto turning_point = [&](const glm::vec3& side) {
    const float inside = way_through(box, middle, side)[1];
    const float room =
        std::min(inside, free_way(tracer, middle, side, kSwing * way + sphere.radius));
    return to_float3(middle + std::max(0.0F, room - sphere.radius) * side);
  };
  sphere.motion = {.kind = LightMotion::Kind::kSwing, .period = 6};
  sphere.motion.from = turning_point(-to_glm(camera.right));
  sphere.motion.to = turning_point(to_glm(camera.right));
  return sphere;
}

LightProbes make_probes_for_view(const TransferData& data) {
  const Box box = box_around(data.mesh.position);
  const glm::vec3 extent = box.extent();
  // In a flat scene, too, probes are no closer to each other than this.
  const float least = glm::length(extent) / 32;
  ProbeSettings settings;
  settings.spacing = std::max(std::cbrt(extent.x * extent.y * extent.z / kProbeCount), least);
  LightProbes probes = place_probes(data.mesh, settings);
  trace_probes(data, data.mesh.triangle_patch, make_surface_tracer(data.mesh), settings, probes);
  return probes;
}

}  // namespace rebounce::cli
