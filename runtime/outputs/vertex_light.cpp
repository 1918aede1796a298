#include "runtime/outputs/vertex_light.h"

#include <algorithm>
#include <limits>
#include <string>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr std::size_t kVerticesPerTask = 1024;

void mix_patches(const DisplayMesh& mesh, std::span<const Float3> patch_value, float least,
                 std::span<Float3> vertex_value, const Scheduler& scheduler) {
  const std::size_t vertex_count = mesh.position.size();
  if (vertex_value.size() != vertex_count) {
    throw Error("the values at vertices have " + std::to_string(vertex_value.size()) +
                " entries; the mesh has " + std::to_string(vertex_count) + " vertices");
  }
  if (mesh.weight_begin.empty()) {
    std::ranges::fill(vertex_value, Float3{0, 0, 0});
    return;
  }
  parallel_for_pieces(scheduler, vertex_count, kVerticesPerTask, [&](std::size_t v) {
    Float3 sum{0, 0, 0};
    for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
      const Float3& value = patch_value[mesh.weight_patch[k]];
      for (int c = 0; c < kChannelCount; ++c) sum[c] += mesh.weight[k] * value[c];
    }
    for (int c = 0; c < kChannelCount; ++c) vertex_value[v][c] = std::max(sum[c], least);
  });
}

}  // namespace

void reconstruct_at_vertices(const DisplayMesh& mesh, std::span<const Float3> patch_value,
                             std::span<Float3> vertex_value, const Scheduler& scheduler) {
  mix_patches(mesh, patch_value, -std::numeric_limits<float>::infinity(), vertex_value, scheduler);
}

void light_at_vertices(const DisplayMesh& mesh, std::span<const Float3> patch_light,
                       std::span<Float3> vertex_light, const Scheduler& scheduler) {
  mix_patches(mesh, patch_light, 0, vertex_light, scheduler);
}

void clamp_light(std::span<Float3> light, const Scheduler& scheduler) {
  parallel_for_pieces(scheduler, light.size(), kVerticesPerTask, [&](std::size_t v) {
    for (float& channel : light[v]) channel = std::max(channel, 0.0F);
  });
}

}  // namespace rebounce
