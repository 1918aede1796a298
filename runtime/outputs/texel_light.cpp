#include "runtime/outputs/texel_light.h"

#include <algorithm>
#include <limits>
#include <string>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr std::size_t kTexelsPerTask = 1024;

void check_texel_count(std::size_t size, std::size_t wanted, const char* name) {
  if (size == wanted) return;
  throw Error(std::string("lightmap: ") + name + " have " + std::to_string(size) +
              " entries; there must be " + std::to_string(wanted));
}

void interpolate(const Lightmap& lightmap, const DisplayMesh& mesh,
                 std::span<const Float3> vertex_value, float least, std::span<Float3> texel_value,
                 const Scheduler& scheduler) {
  check_texel_count(vertex_value.size(), mesh.position.size(), "the values at vertices");
  check_texel_count(texel_value.size(), lightmap.triangle.size(), "the values at texels");
  parallel_for_pieces(scheduler, texel_value.size(), kTexelsPerTask, [&](std::size_t k) {
    const std::uint32_t t = lightmap.triangle[k];
    if (t == kNone) {
      texel_value[k] = {0, 0, 0};
      return;
    }
    const auto [second, third] = lightmap.weight[k];
    const float first = 1 - second - third;
    const auto [a, b, c] = mesh.triangle[t];
    for (int i = 0; i < kChannelCount; ++i) {
      texel_value[k][i] = std::max(least, first * vertex_value[a][i] + second * vertex_value[b][i] +
                                              third * vertex_value[c][i]);
    }
  });
}

}  // namespace

void interpolate_at_texels(const Lightmap& lightmap, const DisplayMesh& mesh,
                           std::span<const Float3> vertex_value, std::span<Float3> texel_value,
                           const Scheduler& scheduler) {
  interpolate(lightmap, mesh, vertex_value, -std::numeric_limits<float>::infinity(), texel_value,
              scheduler);
}

void light_at_texels(const Lightmap& lightmap, const DisplayMesh& mesh,
                     std::span<const Float3> vertex_value, std::span<Float3> texel_light,
                     const Scheduler& scheduler) {
  interpolate(lightmap, mesh, vertex_value, 0, texel_light, scheduler);
}

}  // namespace rebounce
