#include "light_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/glm.hpp>
#include <limits>

#include "rebounce/precompute/random_lights.h"
#include "rebounce/runtime/direct_lighting.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"

namespace rebounce::bench {
namespace {

/// Two places for a lamp, far enough from each other that it can move between them.
std::pair<Light, Light> find_places(const TransferData& data, const RayTracer& tracer,
                                    double distance, std::uint64_t seed) {
  constexpr int kTries = 64;
  const std::vector<Light> lamps = random_point_lights(data, tracer, kTries, seed);
  for (const Light& other : lamps) {
    if (glm::distance(to_dvec3(lamps[0].position), to_dvec3(other.position)) > distance) {
      return {lamps[0], other};
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

}  // namespace

double scene_diagonal(const TransferData& data) {
  glm::dvec3 low(std::numeric_limits<double>::max()), high = -low;
  for (const Float3& p : data.mesh.position) {
    low = glm::min(low, to_dvec3(p));
    high = glm::max(high, to_dvec3(p));
  }
  return glm::length(high - low);
}

std::vector<LightChange> light_changes(const TransferData& data, std::span<const double> motions,
                                       std::uint64_t seed) {
  const RayTracer tracer(data.mesh.position,
                         std::span(data.mesh.triangle).first(data.mesh.surface_count()));
  DirectLighting direct(data, tracer);
  const auto light = [&](const Light& lamp) {
    std::vector<Float3> exitance(data.patches.size());
    direct.compute({&lamp, 1}, {}, exitance);
    for (std::size_t i = 0; i < exitance.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) exitance[i][c] *= data.patches.reflectance[i][c];
    }
    if (area_norm(exitance, data.patches.area) == 0) {
      throw Error("the test lamp lights nothing; the scene must have lit patches that reflect");
    }
    return exitance;
  };
  const double size = scene_diagonal(data);
  const auto [lamp, other] = find_places(data, tracer, 0.2 * size, seed);
  const std::vector<Float3> before = light(lamp);
  std::vector<LightChange> changes = {{"from zero", {}, before}};
  for (const double part : motions) {
    changes.push_back(
        {fmt::format("moved {:g} %", 100 * part), before, light(moved(lamp, other, part * size))});
  }
  changes.push_back({"switched", before, light(other)});
  return changes;
}

}  // namespace rebounce::bench
