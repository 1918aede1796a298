#pragma once

// Light at points by many rays, each with the radiosity of what it meets.

#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "runtime/frame/engine_parts.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce::test {

/// The radiosity of what a ray from `origin` meets in each direction; 0 in the open, and of sides
/// without a patch.
inline std::vector<glm::dvec3> met_radiosity(const Engine& engine, const Float3& origin,
                                             std::span<const glm::dvec3> direction) {
  const DisplayMesh& mesh = engine.data().mesh;
  std::vector<Ray> rays;
  for (const glm::dvec3& d : direction) {
    rays.push_back({.origin = origin,
                    .t_near = 0,
                    .direction = to_float3(d),
                    .t_far = std::numeric_limits<float>::infinity()});
  }
  std::vector<Hit> hits(rays.size());
  engine.parts().tracer->intersect(rays, hits);
  std::vector<glm::dvec3> met(hits.size(), glm::dvec3(0));
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (hits[k].triangle == kNone) continue;
    const std::uint32_t side =
        hits[k].front ? hits[k].triangle : mesh.back_triangle[hits[k].triangle];
    if (side == kNone || mesh.triangle_patch[side] == kNone) continue;
    met[k] = to_dvec3(engine.radiosity()[mesh.triangle_patch[side]]);
  }
  return met;
}

/// The irradiance at `origin` on a surface with this normal.
inline glm::dvec3 irradiance_at(const Engine& engine, const Float3& origin, const Float3& normal,
                                std::uint32_t ray_count) {
  const glm::dmat3 frame = frame_around(to_dvec3(normal));
  std::vector<glm::dvec3> direction;
  for (std::uint32_t k = 0; k < ray_count; ++k) {
    direction.push_back(frame * square_to_cosine_hemisphere(r2_point(k, {0.3, 0.7})));
  }
  glm::dvec3 sum(0);
  for (const glm::dvec3& b : met_radiosity(engine, origin, direction)) sum += b;
  return sum / static_cast<double>(ray_count);
}

}  // namespace rebounce::test
