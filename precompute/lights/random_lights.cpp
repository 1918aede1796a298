#include "precompute/lights/random_lights.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "precompute/sampling/hemisphere_rays.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/box.h"
#include "runtime/rays/cumulative_choice.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

using Exitance = std::vector<Float3>;

constexpr float kDegree = std::numbers::pi_v<float> / 180;

// The least distance of a point light from surfaces: a fraction of the free way between them, and a
// mean patch size where there is enough room. Nearer lights light parts of patches, which patches
// cannot resolve.
constexpr double kLeastPart = 0.1;

/// Lights of different kinds are independent, from the same seed.
std::uint64_t bits_of(LightKind kind, std::uint64_t seed, int k) {
  return mix_bits(mix_bits(seed + static_cast<std::uint64_t>(kind)) + 0x51ED270BULL * k);
}

Float3 random_direction(std::uint64_t bits) {
  const glm::dvec2 s = unit_square(bits);
  const double z = 1 - 2 * s.x, r = std::sqrt(std::max(0.0, 1 - z * z));
  const double phi = 2 * std::numbers::pi * s.y;
  return to_float3(glm::dvec3(r * std::cos(phi), r * std::sin(phi), z));
}

/// Draws sources with probability in proportion to their areas.
class PatchChoice {
 public:
  PatchChoice(std::span<const float> area, const PatchRoles& roles) {
    for (std::size_t i = 0; i < area.size(); ++i) choice_.add(roles.is_source(i) ? area[i] : 0);
    const std::size_t count = roles.count(PatchRoles::kSource, area.size());
    mean_size_ = std::sqrt(choice_.total() / static_cast<double>(count));
  }

  std::uint32_t choose(double number) const {
    return static_cast<std::uint32_t>(choice_.choose(number).index);
  }

  double mean_size() const { return mean_size_; }  ///< metres

 private:
  CumulativeChoice choice_;
  double mean_size_;
};

std::vector<Light> random_spots(const TransferData& data, const RayTracer& tracer, int count,
                                std::uint64_t seed, const PatchRoles& roles) {
  std::vector<Light> lights =
      random_point_lights(data, tracer, count, bits_of(LightKind::kSpot, seed, 0), roles);
  for (int k = 0; k < count; ++k) {
    const std::uint64_t bits = bits_of(LightKind::kSpot, seed, k);
    const glm::dvec2 s = unit_square(bits);
    lights[k].type = LightType::kSpot;
    lights[k].direction = random_direction(mix_bits(bits));
    lights[k].outer_cone_angle = kDegree * static_cast<float>(10 + 50 * s.x);
    lights[k].inner_cone_angle = static_cast<float>(s.y) * lights[k].outer_cone_angle;
  }
  return lights;
}

std::vector<Light> random_suns(int count, std::uint64_t seed) {
  std::vector<Light> lights(count);
  for (int k = 0; k < count; ++k) {
    lights[k].type = LightType::kDirectional;
    lights[k].direction = random_direction(bits_of(LightKind::kSky, seed, k));
  }
  return lights;
}

/// For each of `count` lights, one patch that emits 1 lx.
std::vector<Exitance> random_patches(const PatchTable& patches, int count, std::uint64_t seed,
                                     const PatchRoles& roles) {
  const PatchChoice choice(patches.area, roles);
  std::vector<Exitance> exitances(count, Exitance(patches.size(), Float3{0, 0, 0}));
  for (int k = 0; k < count; ++k) {
    exitances[k][choice.choose(unit_square(bits_of(LightKind::kPatch, seed, k)).x)] = {1, 1, 1};
  }
  return exitances;
}

/// The initial exitance of sources under each of `lights`, and before them under the sky if it has
/// any luminance.
std::vector<Exitance> lit_by(const TransferData& data, const RayTracer& tracer,
                             const PatchRoles& roles, std::span<const Light> lights,
                             const Sky& sky = {}) {
  DirectLighting direct_lighting(data, tracer);
  std::vector<Exitance> exitances;
  const auto add = [&](std::span<const Light> light, const Sky& with_sky) {
    Exitance exitance(data.patches.size());
    direct_lighting.compute(light, with_sky, exitance);
    reflect(data.patches.reflectance, exitance);
    roles.keep(PatchRoles::kSource, exitance);
    if (area_norm(exitance, data.patches.area) > 0) exitances.push_back(std::move(exitance));
  };
  if (sky.luminance > 0) add({}, sky);
  for (const Light& light : lights) add({&light, 1}, {});
  return exitances;
}

bool is_open(const PatchTable& patches) {
  return std::ranges::any_of(patches.sky_visibility, [](float v) { return v > 0; });
}

}  // namespace

std::string_view name(LightKind kind) {
  switch (kind) {
    case LightKind::kPoint:
      return "point";
    case LightKind::kSpot:
      return "spot";
    case LightKind::kPatch:
      return "patch";
    case LightKind::kSky:
      break;
  }
  return "sky";
}

std::vector<Light> random_point_lights(const TransferData& data, const RayTracer& tracer, int count,
                                       std::uint64_t seed, const PatchRoles& roles) {
  const DisplayMesh& mesh = data.mesh;
  const double open_reach = 0.25 * box_around(mesh.position).diagonal();
  const PatchTriangles triangles(mesh.triangle_patch, data.patches.size());
  const PatchChoice choice(data.patches.area, roles);
  std::vector<Light> lights(count);
  for (int k = 0; k < count; ++k) {
    const std::uint64_t bits = mix_bits(seed + 0x51ED270BULL * k);
    const std::uint32_t patch = choice.choose(unit_square(mix_bits(bits + 3)).x);
    std::array<PatchPoint, 1> point;
    std::array<Ray, 1> ray;
    std::array<Hit, 1> hit;
    spread_points(mesh, triangles[patch], unit_square(mix_bits(bits + 1)), point);
    make_hemisphere_rays(point, tracer, unit_square(mix_bits(bits + 2)), ray);
    tracer.intersect(ray, hit);
    const double reach = hit[0].triangle == kNone ? open_reach : hit[0].t;
    const double part = kLeastPart + (1 - 2 * kLeastPart) * unit_square(mix_bits(bits)).x;
    const double clear = std::min(choice.mean_size(), 0.5 * reach);
    const double distance = std::clamp(part * reach, clear, reach - clear);
    lights[k].position = to_float3(to_dvec3(ray[0].origin) + distance * to_dvec3(ray[0].direction));
  }
  return lights;
}

std::vector<Exitance> random_initial_exitances(const TransferData& data, const RayTracer& tracer,
                                               LightKind kind, int count, std::uint64_t seed,
                                               const PatchRoles& roles) {
  switch (kind) {
    case LightKind::kPoint:
      return lit_by(data, tracer, roles, random_point_lights(data, tracer, count, seed, roles));
    case LightKind::kSpot:
      return lit_by(data, tracer, roles, random_spots(data, tracer, count, seed, roles));
    case LightKind::kPatch:
      return random_patches(data.patches, count, seed, roles);
    case LightKind::kSky:
      break;
  }
  if (count == 0 || !is_open(data.patches)) return {};
  return lit_by(data, tracer, roles, random_suns(count - 1, seed), {.luminance = 1});
}

bool arrives_nowhere(std::span<const Float3> irradiance, std::span<const Float3> exitance,
                     std::span<const float> area) {
  constexpr double kDark = 1e-6;
  return area_norm(irradiance, area) <= kDark * area_norm(exitance, area);
}

}  // namespace rebounce
