#include "runtime/outputs/probe_irradiance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/outputs/planar_light.h"
#include "runtime/outputs/probe_access.h"
#include "runtime/outputs/seen_sky.h"
#include "runtime/outputs/spherical_harmonics.h"
#include "transfer/base/argument_check.h"

namespace rebounce {
namespace {

// Mean cosine of a cone with a half angle of 45 degrees. Degree 2 is enough for wider sources.
constexpr float kLeastSharpness = 0.85F;
constexpr float kLeastWidth = 1e-3F;
constexpr std::size_t kBlock = 64;
constexpr std::size_t kBakedProbesPerTask = 4;

/// A block of normals, stored by coordinates, so that the compiler vectorises loops over them.
class NormalBlock {
 public:
  explicit NormalBlock(std::span<const Float3> normals) : normals_(normals) {
    for (std::size_t k = 0; k < normals.size(); ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) axis_[axis][k] = normals[k][axis];
    }
  }

  std::size_t size() const { return normals_.size(); }
  const Float3& operator[](std::size_t k) const { return normals_[k]; }
  const float* axis(std::size_t a) const { return axis_[a].data(); }

 private:
  std::span<const Float3> normals_;
  alignas(64) std::array<std::array<float, kBlock>, 3> axis_{};
};

/// The irradiance at one point on a block of normals.
class IrradianceSum {
 public:
  explicit IrradianceSum(const NormalBlock& normals) : normals_(normals) {}

  void add(const Harmonics& weight, const Float3& color) {
    if (color == Float3{0, 0, 0}) return;
    const LightSpot spot = spot_of(weight);
    if (spot.sharpness < kLeastSharpness) {
      wide_.add(weight, color);
    } else {
      add_spot(spot, color);
    }
  }

  /// Writes the sums divided by `divisor`.
  void write(float divisor, std::span<Float3> irradiance) const {
    const auto wide = wide_.interleaved();
    for (std::size_t k = 0; k < normals_.size(); ++k) {
      irradiance[k] = irradiance_of(wide, normals_[k]);
      for (std::size_t c = 0; c < kChannelCount; ++c) {
        irradiance[k][c] = std::max(0.0F, (irradiance[k][c] + spots_[c][k]) / divisor);
      }
    }
  }

 private:
  /// Treats a spot as a disc with the same mean cosine. Above the horizon its irradiance is the
  /// cosine of its centre, exactly; where the horizon cuts it, a parabola leads smoothly to zero.
  void add_spot(const LightSpot& spot, const Float3& color) {
    const auto& d = spot.direction;
    // The sine of the disc's half angle; its cosine is 2 sharpness - 1.
    const float width = std::max(2 * std::sqrt(spot.sharpness * (1 - spot.sharpness)), kLeastWidth);
    const float curvature = 0.25F / width, strength = spot.amount * spot.sharpness;
    const Float3 most = {strength * color[0], strength * color[1], strength * color[2]};
    const float *nx = normals_.axis(0), *ny = normals_.axis(1), *nz = normals_.axis(2);
    float *red = spots_[0].data(), *green = spots_[1].data(), *blue = spots_[2].data();
#pragma omp simd
    for (std::size_t k = 0; k < kBlock; ++k) {
      const float cosine = nx[k] * d[0] + ny[k] * d[1] + nz[k] * d[2];
      const float risen = std::min(std::max(cosine + width, 0.0F), 2 * width);
      const float lobe = curvature * risen * risen + std::max(cosine - width, 0.0F);
      red[k] += most[0] * lobe;
      green[k] += most[1] * lobe;
      blue[k] += most[2] * lobe;
    }
  }

  const NormalBlock& normals_;
  PlanarLight wide_;
  alignas(64) std::array<std::array<float, kBlock>, kChannelCount> spots_{};
};

Float3 scaled(const Float3& color, float factor) {
  return {factor * color[0], factor * color[1], factor * color[2]};
}

/// Adds `factor` times what probe `p` sees.
void add_view(const LightProbes& probes, std::size_t p, std::span<const Float3> radiosity,
              const SeenSky<Harmonics>& sky, float factor, IrradianceSum& sum) {
  for (std::uint32_t e = probes.entry_begin[p]; e < probes.entry_begin[p + 1]; ++e) {
    sum.add(probes.entry_weight[e], scaled(radiosity[probes.entry_patch[e]], factor));
  }
  const Float3 luminance = scaled(sky.luminance(), factor);
  if (luminance == Float3{0, 0, 0}) return;
  sky.for_each_part(
      p, [&](const Harmonics& weight, float part) { sum.add(weight, scaled(luminance, part)); });
}

/// Calls visit(block, first) for the normals, block by block.
template <typename Visit>
void for_each_block(std::span<const Float3> normals, const Visit& visit) {
  for (std::size_t first = 0; first < normals.size(); first += kBlock) {
    visit(NormalBlock(normals.subspan(first, std::min(kBlock, normals.size() - first))), first);
  }
}

}  // namespace

void irradiance_at_probes(const LightProbes& probes, std::span<const Float3> radiosity,
                          const Sky& sky, std::span<const Float3> normals,
                          std::span<Float3> irradiance, const Scheduler& scheduler) {
  if (probes.size() == 0 && irradiance.empty()) return;
  check_probes(probes);
  check_size("probes: the irradiance", irradiance.size(), probes.size() * normals.size());
  check_size("probes: the radiosity", radiosity.size(), probes.patch_count);
  const SeenSky seen_sky(probes.sky, probes.sky_cells, sky);
  for_each_block(normals, [&](const NormalBlock& block, std::size_t first) {
    parallel_for_pieces(scheduler, probes.size(), kBakedProbesPerTask, [&](std::size_t p) {
      IrradianceSum sum(block);
      add_view(probes, p, radiosity, seen_sky, 1, sum);
      sum.write(1, irradiance.subspan(p * normals.size() + first, block.size()));
    });
  });
}

void irradiance_in_air(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                       const Float3& position, std::span<const Float3> normals,
                       std::span<Float3> irradiance) {
  check_probes(probes);
  check_size("probes: the irradiance", irradiance.size(), normals.size());
  check_size("probes: the radiosity", radiosity.size(), probes.patch_count);
  const SeenSky seen_sky(probes.sky, probes.sky_cells, sky);
  for_each_block(normals, [&](const NormalBlock& block, std::size_t first) {
    IrradianceSum sum(block);
    const float total = for_each_probe_around(probes, position, [&](std::size_t p, float weight) {
      add_view(probes, p, radiosity, seen_sky, weight, sum);
    });
    sum.write(total > 0 ? total : 1, irradiance.subspan(first, block.size()));
  });
}

}  // namespace rebounce
