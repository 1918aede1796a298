#pragma once

#include <vector>

#include "runtime/rays/box.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The size of the one who looks.
struct Viewer {
  float eye_height = 1.6F;  ///< above the floor, in the scene's unit
  float headroom = 1.9F;    ///< the least height of a place to stand
};

/// One of the views that a scene is offered.
struct CandidateView {
  Camera camera;
  /// What the worth of the view is multiplied by, (0, 1].
  float weight = 1;
};

/// Someone in metres, or, in a scene lower than a person or higher than 50 m, whose unit is hardly
/// the metre, someone half as tall as the scene.
Viewer viewer_for(const Box& scene);

/// Level views in 16 directions from eye height above the floors that are met along 12 x 12 upright
/// lines through `box`. Nothing is within a fifth of the eye's height of an eye, and no eye sees
/// back faces, as from inside a wall. The weight is 1 where surface surrounds the eye in nine
/// tenths of all directions, as in a room with windows, and falls to 0 on an open plain.
std::vector<CandidateView> views_from_floors(const DisplayMesh& mesh, const RayTracer& tracer,
                                             const Box& box, const Viewer& viewer);

/// Views of the whole box, which fills a picture of 4:3: from above, at three angles, in 12
/// directions of which none is straight at a side, and level into those of its sides that are open,
/// as the front of a Cornell box. The weight is 0.85: what has an inside is rather seen from there.
std::vector<CandidateView> views_from_outside(const RayTracer& tracer, const Box& box);

}  // namespace rebounce
