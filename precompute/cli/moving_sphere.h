#pragma once

#include "runtime/demo/viewer/window/viewer_setup.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::cli {

/// A sphere that swings from side to side in front of `camera`, as far as there is room.
ViewerSphere sphere_ahead(const Camera& camera, const RayTracer& tracer, const TransferData& data);

/// Light probes for a file that has none: some hundred in a grid over the scene.
LightProbes make_probes_for_view(const TransferData& data);

}  // namespace rebounce::cli
