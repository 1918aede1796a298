#include "runtime/outputs/probe_light.h"

#include <algorithm>

#include "runtime/outputs/planar_light.h"
#include "runtime/outputs/probe_access.h"
#include "runtime/outputs/seen_sky.h"
#include "runtime/outputs/spherical_harmonics.h"
#include "transfer/base/argument_check.h"

namespace rebounce {
namespace {

constexpr std::size_t kProbesPerTask = 4;

void add_scaled(ProbeLight& sum, const ProbeLight& light, float factor) {
  for (std::size_t k = 0; k < sum.size(); ++k) {
    for (std::size_t c = 0; c < kChannelCount; ++c) sum[k][c] += factor * light[k][c];
  }
}

void divide(ProbeLight& light, float divisor) {
  for (Float3& coefficient : light) {
    for (float& x : coefficient) x /= divisor;
  }
}

/// The light at probe `p`, degrees 0 to 2.
QuadraticProbeLight quadratic_light(const LightProbes& probes, std::size_t p,
                                    std::span<const Float3> radiosity,
                                    const SeenSky<Harmonics>& sky) {
  PlanarLight sum;
  sum.add(sky.coefficients(p), sky.luminance());
  for (std::uint32_t e = probes.entry_begin[p]; e < probes.entry_begin[p + 1]; ++e) {
    sum.add(probes.entry_weight[e], radiosity[probes.entry_patch[e]]);
  }
  return sum.interleaved();
}

ProbeLight light_of_probe(const LightProbes& probes, std::size_t p,
                          std::span<const Float3> radiosity, const SeenSky<Harmonics>& sky) {
  PlanarLight degree_4;
  degree_4.add(sky.degree_4(p), sky.luminance());
  ProbeLight light;
  const auto rest = std::ranges::copy(quadratic_light(probes, p, radiosity, sky), light.begin());
  std::ranges::copy(degree_4.interleaved(), rest.out);
  return light;
}

/// Writes light_of(probe) for each probe.
template <typename Light, typename LightOf>
void apply(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
           const LightOf& light_of, std::span<Light> light, const Scheduler& scheduler) {
  if (probes.size() == 0 && light.empty()) return;
  check_probes(probes);
  check_size("probes: the result", light.size(), probes.size());
  check_size("probes: the radiosity", radiosity.size(), probes.patch_count);
  const SeenSky seen_sky(probes.sky, probes.sky_cells, sky);
  parallel_for_pieces(scheduler, probes.size(), kProbesPerTask,
                      [&](std::size_t p) { light[p] = light_of(probes, p, radiosity, seen_sky); });
}

}  // namespace

void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<ProbeLight> light, const Scheduler& scheduler) {
  apply(probes, radiosity, sky, light_of_probe, light, scheduler);
}

void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<QuadraticProbeLight> light, const Scheduler& scheduler) {
  apply(probes, radiosity, sky, quadratic_light, light, scheduler);
}

Float3 probe_irradiance(const ProbeLight& light, const Float3& normal) {
  return irradiance_of(light, normal);
}

Float3 probe_irradiance(const QuadraticProbeLight& light, const Float3& normal) {
  return irradiance_of(light, normal);
}

ProbeLight interpolate_probes(const LightProbes& probes, std::span<const ProbeLight> light,
                              const Float3& position) {
  ProbeLight sum{};
  if (light.size() != probes.size()) return sum;
  const float total = for_each_probe_around(probes, position, [&](std::size_t probe, float weight) {
    add_scaled(sum, light[probe], weight);
  });
  if (total > 0) divide(sum, total);
  return sum;
}

ProbeLight gather_probe_light(const LightProbes& probes, std::span<const Float3> radiosity,
                              const Sky& sky, const Float3& position) {
  check_probes(probes);
  check_size("probes: the radiosity", radiosity.size(), probes.patch_count);
  const SeenSky seen_sky(probes.sky, probes.sky_cells, sky);
  ProbeLight sum{};
  const float total = for_each_probe_around(probes, position, [&](std::size_t probe, float weight) {
    add_scaled(sum, light_of_probe(probes, probe, radiosity, seen_sky), weight);
  });
  if (total > 0) divide(sum, total);
  return sum;
}

}  // namespace rebounce
