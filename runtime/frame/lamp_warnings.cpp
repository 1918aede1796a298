#include "runtime/frame/lamp_warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/frame/engine_parts.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kRays = 256;

// The part of the rays from inside of a body that meet its inside. A lamp that lights something may
// stand in a lampshade or a niche.
constexpr double kInsideDark = 0.5, kInsideLit = 0.9;

/// `count` directions, evenly spread over the sphere, from `origin`.
std::vector<Ray> rays_around(const Float3& origin, std::uint32_t count) {
  std::vector<Ray> rays(count);
  for (std::uint32_t k = 0; k < count; ++k) {
    const glm::dvec2 s = r2_point(k, {0, 0});
    const double y = 1 - 2 * s.x, across = std::sqrt(1 - y * y);
    const double turn = 2 * std::numbers::pi * s.y;
    rays[k].origin = origin;
    rays[k].t_near = 0;
    rays[k].direction = {static_cast<float>(across * std::cos(turn)), static_cast<float>(y),
                         static_cast<float>(across * std::sin(turn))};
    rays[k].t_far = std::numeric_limits<float>::infinity();
  }
  return rays;
}

/// The part of all directions in which `place` sees the back of a surface, or a side without a
/// patch.
double part_of_backs(const DisplayMesh& mesh, const RayTracer& tracer, const Float3& place) {
  const std::vector<Ray> rays = rays_around(place, kRays);
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  const auto is_back = [&](const Hit& hit) {
    if (hit.triangle == kNone) return false;
    const std::uint32_t side = hit.front ? hit.triangle : mesh.back_triangle[hit.triangle];
    return side == kNone || mesh.triangle_patch[side] == kNone;
  };
  return static_cast<double>(std::ranges::count_if(hits, is_back)) / kRays;
}

std::string described(std::size_t number, const Light& light) {
  const std::string name = light.name.empty() ? "" : " \"" + light.name + "\"";
  return "light " + std::to_string(number) + name + " (" + std::string(lamp_kind(light.type).name) +
         ")";
}

}  // namespace

std::vector<std::string> lamp_warnings(const Engine& engine, std::span<const Light> lights) {
  check_lights(lights);
  std::vector<std::string> warnings;
  const DisplayMesh& mesh = engine.data().mesh;
  DirectLighting alone(*engine.parts().direct_lighting);
  std::vector<Float3> direct(engine.direct_irradiance().size());
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const Light& light = lights[k];
    if (light.intensity == 0 || light.color == Float3{0, 0, 0}) continue;
    alone.compute({&light, 1}, {}, direct, engine.scheduler());
    const bool lights_something = std::ranges::any_of(direct, [](const Float3& e) {
      return e != Float3{0, 0, 0};
    });
    const bool has_place = lamp_kind(light.type).has_place();
    const double backs =
        has_place ? part_of_backs(mesh, *engine.parts().tracer, light.position) : 0;
    if (backs > (lights_something ? kInsideLit : kInsideDark)) {
      warnings.push_back(described(k, light) +
                         (lights_something ? " has its middle inside of a wall, a floor or another "
                                             "body: only what sticks out of it shines"
                                           : " is inside of a wall, a floor or another body: no "
                                             "light of it arrives anywhere; move it"));
    } else if (!lights_something) {
      warnings.push_back(described(k, light) +
                         (has_place ? " lights nothing: check its position, direction and range"
                                    : " lights nothing: no opening of the scene lets it in; check "
                                      "its direction"));
    }
  }
  return warnings;
}

}  // namespace rebounce
