#include "runtime/outputs/surface_light.h"

#include <algorithm>
#include <string>

#include "rebounce/error.h"
#include "runtime/outputs/seen_sky.h"
#include "runtime/outputs/spherical_harmonics.h"

namespace rebounce {
namespace {

constexpr std::size_t kPatchesPerTask = 64, kNormalsPerTask = 512;

// A larger gain is not reliable: the series may be too small at the surface's own normal.
constexpr float kLargestGain = 4;

void check_size(std::size_t size, std::size_t wanted, const char* name) {
  if (size == wanted) return;
  throw Error(std::string("surface harmonics: ") + name + " has " + std::to_string(size) +
              " entries; it must have " + std::to_string(wanted));
}

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
  check_size(light.size(), n, "the result");
  check_size(radiosity.size(), n, "the radiosity");
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
  check_size(vertex_light.size(), mesh.position.size(), "the light at vertices");
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
