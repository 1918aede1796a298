#include "rebounce/runtime/probe_light.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "rebounce/runtime/spherical_harmonics.h"
#include "rebounce/transfer/error.h"
#include "seen_sky.h"

namespace rebounce {
namespace {

/// Adds `weight` times a colour to the coefficients, which are kept channel by channel so that the
/// compiler has rows to work on.
struct PlanarLight {
  std::array<Harmonics, kChannelCount> channel{};

  void add(const Harmonics& weight, const Float3& color) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < kHarmonicCount; ++k) channel[c][k] += color[c] * weight[k];
    }
  }
  QuadraticProbeLight interleaved() const {
    QuadraticProbeLight light;
    for (std::size_t k = 0; k < kHarmonicCount; ++k) {
      light[k] = {channel[0][k], channel[1][k], channel[2][k]};
    }
    return light;
  }
};

/// Where a coordinate lies in a row of evenly spaced probes.
struct GridPlace {
  std::uint32_t low = 0, high = 0;
  float fraction = 0;
};

GridPlace place_in_row(float x, float first, float last, std::uint32_t count) {
  if (count < 2 || !(last > first)) return {};
  const auto end = static_cast<float>(count - 1);
  const float at = std::clamp((x - first) / (last - first) * end, 0.0F, end);
  const auto low = std::min(static_cast<std::uint32_t>(at), count - 2);
  return {low, low + 1, at - static_cast<float>(low)};
}

/// Calls visit(probe, weight) for the valid ones of the eight probes around `position`, by
/// trilinear weights; returns the sum of them, 0 if the probes are no grid.
template <typename Visit>
float for_each_probe_around(const LightProbes& probes, const Float3& position, const Visit& visit) {
  const auto [nx, ny, nz] = probes.grid;
  if (nx == 0) return 0;
  const Float3& first = probes.position.front();
  const Float3& last = probes.position.back();
  std::array<GridPlace, 3> place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    place[axis] = place_in_row(position[axis], first[axis], last[axis], probes.grid[axis]);
  }
  float total = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    float weight = 1;
    std::array<std::uint32_t, 3> at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool high = (corner >> axis & 1U) != 0;
      weight *= high ? place[axis].fraction : 1 - place[axis].fraction;
      at[axis] = high ? place[axis].high : place[axis].low;
    }
    const std::size_t probe = at[0] + std::size_t{nx} * (at[1] + std::size_t{ny} * at[2]);
    if (weight <= 0 || probes.valid[probe] == 0) continue;
    total += weight;
    visit(probe, weight);
  }
  return total;
}

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

/// What probe `p` sees.
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

void check_size(std::size_t size, std::size_t wanted, const char* name) {
  if (size == wanted) return;
  throw Error(std::string("probes: ") + name + " has " + std::to_string(size) +
              " entries; it must have " + std::to_string(wanted));
}

/// Writes what light_of finds for each probe.
template <typename Light, typename LightOf>
void apply(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
           const LightOf& light_of, std::span<Light> light) {
  check_size(light.size(), probes.size(), "the result");
  if (probes.size() == 0) return;
  check_size(radiosity.size(), probes.patch_count, "the radiosity");
  const SeenSky seen_sky(probes.sky, probes.sky_cells, sky);
#pragma omp parallel for schedule(static)
  for (std::size_t p = 0; p < probes.size(); ++p) {
    light[p] = light_of(probes, p, radiosity, seen_sky);
  }
}

}  // namespace

void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<ProbeLight> light) {
  apply(probes, radiosity, sky, light_of_probe, light);
}

void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<QuadraticProbeLight> light) {
  apply(probes, radiosity, sky, quadratic_light, light);
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
  check_size(radiosity.size(), probes.patch_count, "the radiosity");
  const SeenSky seen_sky(probes.sky, probes.sky_cells, sky);
  ProbeLight sum{};
  const float total = for_each_probe_around(probes, position, [&](std::size_t probe, float weight) {
    add_scaled(sum, light_of_probe(probes, probe, radiosity, seen_sky), weight);
  });
  if (total > 0) divide(sum, total);
  return sum;
}

}  // namespace rebounce
