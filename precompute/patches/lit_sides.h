#pragma once

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "precompute/patches/triangle_sides.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Classifies the sides of every triangle [t].
///
/// - A one-sided triangle has its front.
/// - A side of a double-sided triangle that sees no other surface (the outside of the wall of a
///   room) neither gives light to anything nor receives any, so that nothing changes if it is left
///   out. One side is kept in any case.
/// - A side that lies flat on the front of another surface (the bottom of a box on a floor) sees
///   nothing either, and rays from it would begin beyond that surface. Two one-sided surfaces back
///   to back that form a sheet are different: on neither face of it is a solid, and each is lit.
/// - A side that only sees backs of one-sided surfaces, all of them near (a sixteenth of the
///   diagonal of the scene), is inside a solid: the leg of a table in the wall. Backs absorb light,
///   so leaving it out only matters for lamps inside.
/// - A side inside a closed double-sided shell that is no room, such as a cushion, is left out too:
///   all that it exchanges light with is hidden as well. Cracks through which a few hundredths of
///   the light leave do not count, and neither does a shell around a surface that emits.
/// - Of copies that lie in one another (z-fighting) only one is visible, and shadow rays between
///   points cannot tell which: a side that others cover entirely yields to them.
///
/// kOpening is not found here. `tracer` holds all triangles of the scene. Deterministic. Throws
/// Cancelled if asked to stop.
std::vector<TriangleSides> find_lit_sides(const Scene& scene, const RayTracer& tracer,
                                          const Progress& progress = {});

/// A side that contains a given point of a surface.
struct CoincidentSide {
  std::uint32_t triangle;
  bool front;
  /// It faces the same way as the surface; otherwise it faces the surface and touches it.
  bool same_way;
};

/// Finds sides of other triangles than `triangle` that contain `point`, to the precision of rays:
/// of double-sided triangles the side that faces along `normal` (unit), of others the front.
/// `is_double_sided`(t) tells which are double-sided; `hits` is scratch.
template <typename IsDoubleSided>
void find_coincident_sides(const RayTracer& tracer, const Float3& point, const Float3& normal,
                           std::uint32_t triangle, const IsDoubleSided& is_double_sided,
                           std::vector<Hit>& hits, std::vector<CoincidentSide>& sides) {
  Ray ray{};
  ray.origin = tracer.offset_point(point, normal);
  ray.direction = {-normal[0], -normal[1], -normal[2]};
  ray.t_near = 0;
  ray.t_far = 2 * tracer.offset_distance();
  hits.clear();
  sides.clear();
  tracer.intersect_all(ray, hits);
  for (const Hit& hit : hits) {
    if (hit.triangle == triangle) continue;
    const bool same_way = hit.front || is_double_sided(hit.triangle);
    sides.push_back({hit.triangle, hit.front || !same_way, same_way});
  }
}

}  // namespace rebounce
