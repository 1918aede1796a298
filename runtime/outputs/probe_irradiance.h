#pragma once

#include <span>

#include "rebounce/scene_data.h"
#include "rebounce/sky.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Writes the irradiance in lx at each probe p on surfaces of each of the K unit `normals`:
/// irradiance[p K + k], at least 0. Each patch and each cell of the sky that a probe sees is a spot
/// of light with a cosine of its own. So small bright surfaces in view stay sharp, which spherical
/// harmonics of a low degree would blur. Only spots wider than a cone of 45 degrees to each side
/// are taken as harmonics, to degree 2. Arguments, light and errors are those of apply_probes;
/// probes that are not valid get none. Neither allocates nor locks; the same bits for any
/// `scheduler`.
void irradiance_at_probes(const LightProbes& probes, std::span<const Float3> radiosity,
                          const Sky& sky, std::span<const Float3> normals,
                          std::span<Float3> irradiance, const Scheduler& scheduler = {});

/// The same at a point in the air: irradiance [K], the mean over the probes around the point with
/// the weights of gather_probe_light. It takes the time of these probes, eight at most.
void irradiance_in_air(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                       const Float3& position, std::span<const Float3> normals,
                       std::span<Float3> irradiance);

}  // namespace rebounce
