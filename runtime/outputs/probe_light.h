#pragma once

#include <span>

#include "rebounce/outputs.h"
#include "rebounce/scene_data.h"
#include "rebounce/sky.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Writes the light that arrives at each probe [p] from patches of `radiosity` [n] in lx and from
/// `sky`: by its cells where the probes know them, else by its mean. It has no light of lamps.
/// Degree 4 is that of the sky alone, whose light is sharp, and zero where the cells are not known.
/// Probes that are not valid get none. Neither allocates nor locks; the same bits for any
/// `scheduler`. Throws Error if a size is wrong.
void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<ProbeLight> light, const Scheduler& scheduler = {});

/// The same without degree 4.
void apply_probes(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                  std::span<QuadraticProbeLight> light, const Scheduler& scheduler = {});

/// What interpolate_probes gives, for a few points, without apply_probes: gathers at no more than
/// the eight probes around `position`. Arguments and errors are those of apply_probes.
ProbeLight gather_probe_light(const LightProbes& probes, std::span<const Float3> radiosity,
                              const Sky& sky, const Float3& position);

}  // namespace rebounce
