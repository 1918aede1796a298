#pragma once

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A view of a scene from its geometry alone: whatever lights the scene, and into however many
/// patches it is divided, the view is the same.
///
/// Of level views from eye height inside of the scene and of views from around it, it is the one of
/// the highest view_score(), times its weight. `tracer` holds the surface of the scene. Gives the
/// same view for any number of OpenMP threads.
Camera default_view(const DisplayMesh& mesh, const RayTracer& tracer);

/// The first camera of the scene, or default_view() if it has none.
Camera default_camera(const TransferData& data, const RayTracer& tracer);

}  // namespace rebounce
