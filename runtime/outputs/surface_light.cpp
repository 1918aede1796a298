#include "runtime/outputs/surface_light.h"

#include <algorithm>

#include "runtime/outputs/seen_sky.h"
#include "runtime/outputs/spherical_harmonics.h"
#include "transfer/base/argument_check.h"

namespace rebounce {
namespace {

constexpr std::size_t kPatchesPerTask = 64, kNormalsPerTask = 512;

// A larger gain is not reliable: the series may be too small at the surface's own normal.
constexpr float kLargestGain = 4;

void add(SurfaceLight& sum, const LinearHarmonics& weight, const Float3& color) {
  for (std::size_t k = 0; k < kLinearHarmonicCount; ++k) {
    for (std::size_t c = 0; c < kChannelCount; ++c) sum[k][c] += weight[k] * color[c];
  }
}

}  // namespace

void apply_surface_harmonics(const SurfaceHarmonics& harmonics, std::span<const Float3> radiosity,
                             const Sky& sky, std::span<SurfaceLight> light,
                             const Scheduler& scheduler) {
  const std::size_t n = harmonics.sky.size();
  check_size("surface harmonics: the result", light.size(), n);
  check_size("surface harmonics: the radiosity", radiosity.size(), n);
  const SeenSky seen_sky(harmonics.sky, harmonics.sky_cells, sky);
  parallel_for_pieces(scheduler, n, kPatchesPerTask, [&](std::size_t i) {
    SurfaceLight sum{};
    add(sum, seen_sky.coefficients(i), seen_sky.luminance());
    for (std::uint32_t e = harmonics.entry_begin[i]; e < harmonics.entry_begin[i + 1]; ++e) {
      add(sum, harmonics.entry_weight[e], radiosity[harmonics.entry_patch[e]]);
    }
    light[i] = sum;
  });
}

void reconstruct_at_vertices(const DisplayMesh& mesh, std::span<const SurfaceLight> patch_light,
                             std::span<SurfaceLight> vertex_light, const Scheduler& scheduler) {
  check_size("surface harmonics: the light at vertices", vertex_light.size(), mesh.position.size());
  parallel_for_pieces(scheduler, vertex_light.size(), kNormalsPerTask, [&](std::size_t v) {
    SurfaceLight sum{};
    if (!mesh.weight_begin.empty()) {
      for (std::uint32_t w = mesh.weight_begin[v]; w < mesh.weight_begin[v + 1]; ++w) {
        const SurfaceLight& of_patch = patch_light[mesh.weight_patch[w]];
        for (std::size_t k = 0; k < kLinearHarmonicCount; ++k) {
          for (std::size_t c = 0; c < kChannelCount; ++c) {
            sum[k][c] += mesh.weight[w] * of_patch[k][c];
          }
        }
      }
    }
    vertex_light[v] = sum;
  });
}

Float3 surface_irradiance(const SurfaceLight& light, const Float3& normal) {
  return irradiance_of(light, normal);
}

Float3 bent_irradiance(const SurfaceLight& light, const Float3& irradiance, const Float3& normal,
                       const Float3& bent) {
  const Float3 before = surface_irradiance(light, normal);
  const Float3 after = surface_irradiance(light, bent);
  Float3 result = irradiance;
  for (std::size_t c = 0; c < kChannelCount; ++c) {
    if (before[c] > 0) result[c] *= std::min(after[c] / before[c], kLargestGain);
  }
  return result;
}

}  // namespace rebounce
