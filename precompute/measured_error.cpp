#include "rebounce/precompute/measured_error.h"

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

#include "hemisphere_rays.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/runtime/direct_lighting.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

glm::dvec3 lowest_corner(const DisplayMesh& mesh) {
  glm::dvec3 low(std::numeric_limits<double>::max());
  for (const Float3& p : mesh.position) low = glm::min(low, to_dvec3(p));
  return low;
}

glm::dvec3 highest_corner(const DisplayMesh& mesh) {
  glm::dvec3 high(std::numeric_limits<double>::lowest());
  for (const Float3& p : mesh.position) high = glm::max(high, to_dvec3(p));
  return high;
}

}  // namespace

std::vector<Light> random_point_lights(const TransferData& data, const RayTracer& tracer, int count,
                                       std::uint64_t seed) {
  const DisplayMesh& mesh = data.mesh;
  const double open_reach = 0.25 * glm::distance(lowest_corner(mesh), highest_corner(mesh));
  const PatchTriangles triangles(mesh.triangle_patch, data.patches.size());
  std::vector<Light> lights(count);
  for (int k = 0; k < count; ++k) {
    const std::uint64_t bits = mix_bits(seed + 0x51ED270BULL * k);
    const std::uint32_t patch = static_cast<std::uint32_t>(bits % data.patches.size());
    std::array<PatchPoint, 1> point;
    std::array<Ray, 1> ray;
    std::array<Hit, 1> hit;
    spread_points(mesh, triangles[patch], unit_square(mix_bits(bits + 1)), point);
    make_hemisphere_rays(point, tracer, unit_square(mix_bits(bits + 2)), ray);
    tracer.intersect(ray, hit);
    const double reach = hit[0].triangle == kNone ? open_reach : hit[0].t;
    const double part = 0.2 + 0.6 * unit_square(mix_bits(bits)).x;
    lights[k].position =
        to_float3(to_dvec3(ray[0].origin) + part * reach * to_dvec3(ray[0].direction));
  }
  return lights;
}

std::vector<std::vector<Float3>> random_initial_exitances(const TransferData& data,
                                                          const RayTracer& tracer, int count,
                                                          std::uint64_t seed) {
  DirectLighting direct_lighting(data, tracer);
  std::vector<std::vector<Float3>> exitances;
  for (const Light& light : random_point_lights(data, tracer, count, seed)) {
    std::vector<Float3>& exitance = exitances.emplace_back(data.patches.size());
    direct_lighting.compute({&light, 1}, {}, exitance);
    for (std::size_t i = 0; i < exitance.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) exitance[i][c] *= data.patches.reflectance[i][c];
    }
  }
  return exitances;
}

MeasuredError measure_error(const TransferData& data, const RayTracer& tracer, int light_count,
                            std::uint64_t seed, const Progress& progress) {
  const ReferenceSolver reference(data.exchange, data.patches);
  std::vector<Float3> indirect_irradiance(data.patches.size());
  std::vector<float> workspace(data.transfer->workspace_size());
  MeasuredError error;
  int done = 0, lit = 0;
  for (const std::vector<Float3>& light :
       random_initial_exitances(data, tracer, light_count, seed)) {
    if (progress && !progress(static_cast<double>(done++) / light_count)) throw Cancelled();
    if (area_norm(light, data.patches.area) == 0) continue;
    data.transfer->apply(light, indirect_irradiance, workspace);
    const std::vector<Float3> truth = reference.indirect_irradiance(light, 1e-9);
    const double e = relative_difference(indirect_irradiance, truth, data.patches.area);
    error.mean += e;
    error.max = std::max(error.max, e);
    ++lit;
  }
  if (lit > 0) error.mean /= lit;
  return error;
}

}  // namespace rebounce
