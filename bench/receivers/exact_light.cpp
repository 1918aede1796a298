#include "bench/receivers/exact_light.h"

#include <cmath>
#include <numeric>

#include "precompute/outputs/row_receivers.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::bench {
namespace {

glm::dvec3 seen(const ViewRow& row, std::span<const Float3> radiosity) {
  glm::dvec3 sum(0);
  for (const auto& [patch, part] : row) {
    sum += static_cast<double>(part) * to_dvec3(radiosity[patch]);
  }
  return sum;
}

}  // namespace

ExactLight::ExactLight(const TransferData& data, const RayTracer& tracer, int ray_count)
    : data_(data), of_patch_(data.patches.size()) {
  const std::vector<std::uint32_t>& patch_of = data.mesh.triangle_patch;
  const std::vector<float>& area = data.patches.area;
  const VertexReceivers receivers(data, patch_of);
  const PatchTriangles triangles(patch_of, area.size());
  const std::vector<std::uint32_t> candidates = receivers.candidates().receiver;
  const double mean_patch_size =
      std::sqrt(std::accumulate(area.begin(), area.end(), 0.0) / static_cast<double>(area.size()));
  std::vector<ViewRow> of_candidate(candidates.size());
#pragma omp parallel
  {
    ReceiverViewer viewer(data.mesh, patch_of, area.size(), tracer, ray_count);
#pragma omp for schedule(dynamic, 16)
    for (std::size_t i = 0; i < of_patch_.size(); ++i) {
      viewer.look_from_patch(triangles[i], of_patch_[i]);
    }
#pragma omp for schedule(dynamic, 16)
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      receivers.look(candidates[k], mean_patch_size, viewer, of_candidate[k]);
    }
  }
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (of_candidate[k].empty()) continue;
    vertices_.push_back(candidates[k]);
    of_vertex_.push_back(std::move(of_candidate[k]));
  }
}

std::vector<Float3> ExactLight::light(std::span<const Float3> indirect,
                                      std::span<const Float3> radiosity) const {
  // A row adds what the vertex sees less what the patches in its weights see.
  std::vector<Float3> rest(indirect.size());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    rest[i] = to_float3(to_dvec3(indirect[i]) - seen(of_patch_[i], radiosity));
  }
  std::vector<Float3> light(data_.mesh.position.size());
  reconstruct_at_vertices(data_.mesh, rest, light);
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    Float3& there = light[vertices_[k]];
    there = to_float3(to_dvec3(there) + seen(of_vertex_[k], radiosity));
  }
  clamp_light(light);
  return light;
}

}  // namespace rebounce::bench
