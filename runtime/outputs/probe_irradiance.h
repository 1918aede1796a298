#pragma once

#include <span>

#include "rebounce/scene_data.h"
#include "rebounce/sky.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Writes the irradiance in lx at each probe p on surfaces of each of the K unit `normals`:
/// irradiance[p K + k], at least 0. What a probe sees of a patch or a cell of the sky is a spot of
/// light that falls by its own cosine, so that small bright surfaces in view (a lamp's) are as
/// sharp as they are, which spherical harmonics of a low degree cannot be; only what spans more
/// than a cone of 45 degrees to each side is taken to degree 2. Arguments, light and errors are
/// those of apply_probes; probes that are not valid get none. Neither allocates nor locks; the
/// same bits for any `scheduler`.
void irradiance_at_probes(const LightProbes& probes, std::span<const Float3> radiosity,
                          const Sky& sky, std::span<const Float3> normals,
                          std::span<Float3> irradiance, const Scheduler& scheduler = {});

/// The same at a point in the air, as a mean of the probes around it as gather_probe_light has it:
/// irradiance [K]. In time it is as many probes as are around the point, eight at most.
void irradiance_in_air(const LightProbes& probes, std::span<const Float3> radiosity, const Sky& sky,
                       const Float3& position, std::span<const Float3> normals,
                       std::span<Float3> irradiance);

}  // namespace rebounce
