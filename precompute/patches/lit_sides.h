#pragma once

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "precompute/patches/triangle_sides.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Finds what each side of every triangle [t] is.
///
/// - A one-sided triangle has its front.
/// - Of a double-sided one, a side that sees no other surface (the outside of a room's wall)
///   neither gives light to anything nor gets any back, so leaving it out of the system changes
///   nothing. One side is kept for that matter.
/// - A side that lies flat on the front of another surface (the bottom of a box on a floor) sees
///   nothing either, and rays from it would begin beyond that surface. Not so two one-sided
///   surfaces back to back that make up a sheet: on neither face of it is something solid, and
///   each is lit.
/// - A side that sees nothing but backs of one-sided surfaces, all of them near (a sixteenth of the
///   scene's diagonal), is inside of something: a leg of a table in the wall. Backs absorb what
///   meets them, so leaving it out changes nothing but for lamps that hang in there.
/// - So is a side inside of a closed double-sided shell that is no room, such as a cushion: what it
///   exchanges light with is as hidden as it is. Cracks that let a few hundredths out do not count,
///   and neither does what is closed around something that emits.
/// - Of copies that lie in one another (z-fighting) only one can be seen, and shadow rays between
///   points cannot tell which: a side that is covered all over by others gives way to them.
///
/// kOpening is not found here. `tracer` holds all triangles of the scene. Deterministic.
/// Throws Cancelled.
std::vector<TriangleSides> find_lit_sides(const Scene& scene, const RayTracer& tracer,
                                          const Progress& progress = {});

/// A side that lies where a point of a surface is.
struct CoincidentSide {
  std::uint32_t triangle;
  bool front;
  bool same_way;  ///< it faces the way the surface faces; else it faces, and touches, the surface
};

/// Finds sides of other triangles than `triangle` that lie at `point`, to within the precision of
/// rays: of double-sided ones the side that faces along `normal` (unit), of others their front.
/// `is_double_sided`(t) tells which are; `hits` is scratch.
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
