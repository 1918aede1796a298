#pragma once

#include <array>
#include <span>

#include "runtime/outputs/spherical_harmonics.h"
#include "transfer/base/parallel.h"
#include "transfer/data/light_probes.h"
#include "transfer/data/scene_description.h"

namespace rebounce {

/// Incoming radiance at a point, cd/m²: coefficients of the irradiance_harmonics, nine of degree 0
/// to 2 and nine of degree 4, each of three channels.
using ProbeLight = std::array<Float3, kIrradianceHarmonicCount>;

/// The first nine of them, for renderers that shade by those.
using QuadraticProbeLight = std::array<Float3, kHarmonicCount>;

/// Writes the light that arrives at each probe [p] from patches of `radiosity` [n] in lx and from
/// `sky`, by its cells where the probes know them, else as its mean; that of lamps is not in it.
/// Degree 4 is that of the sky alone, whose light is sharp, and zero where the cells are not known.
/// Probes that are not valid get none. Neither allocates nor locks; the same bits for any
/// `scheduler`. Throws Error if a size is wrong.
void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<ProbeLight> light, const Scheduler& scheduler = {});

/// The same without degree 4.
void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<QuadraticProbeLight> light, const Scheduler& scheduler = {});

/// The irradiance in lx on a surface with unit `normal`, at least 0: R. Ramamoorthi, P. Hanrahan,
/// "An efficient representation for irradiance environment maps", SIGGRAPH 2001.
Float3 probe_irradiance(const ProbeLight& light, const Float3& normal);
Float3 probe_irradiance(const QuadraticProbeLight& light, const Float3& normal);

/// The light at any point of the grid that `probes` are, between the eight probes around it,
/// without those that are not valid; outside of the grid that of its border. Zero where none of the
/// eight is valid, or if the probes are no grid.
ProbeLight interpolate_probes(const LightProbes& probes, std::span<const ProbeLight> light,
                              const Float3& position);

/// The same for a few points, without apply_probes: gathers at no more than the eight probes around
/// `position`. Arguments and errors are those of apply_probes.
ProbeLight gather_probe_light(const LightProbes& probes, std::span<const Float3> radiosity,
                              const Sky& sky, const Float3& position);

}  // namespace rebounce
