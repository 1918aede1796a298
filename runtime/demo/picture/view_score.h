#pragma once

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Width over height of the picture that a view is judged by; pictures are as wide or wider.
inline constexpr float kViewAspect = 4.0F / 3;

/// How much of a scene a view shows: the higher, the more pieces of surface and the more evenly. It
/// is the viewpoint entropy of P.-P. Vázquez, M. Feixas, M. Sbert and W. Heidrich ("Viewpoint
/// selection using viewpoint entropy", VMV 2001): the entropy of the parts of the picture that the
/// pieces cover. Theirs are triangles; here they are pieces of one material and orientation in a
/// cell of a third of the eye's height, which do not depend on how the scene was divided, and half
/// of the entropy of materials and orientations alone is added. Background is one piece. What is
/// nearer than 5/4 of the eye's height, what gets no light, and what is seen through culled faces
/// lower the value.
///
/// `columns` x `rows` rays are traced. `tracer` holds the surface of the scene. The value does not
/// depend on light.
float view_score(const Camera& camera, const DisplayMesh& mesh, const RayTracer& tracer,
                 float eye_height, int columns, int rows);

}  // namespace rebounce
