#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "precompute/patches/lamp_light.h"
#include "precompute/patches/lit_sides.h"
#include "precompute/patches/subdivision.h"

namespace rebounce {

/// An element up to this fraction of a mean patch counts as seeing much; a larger one gets this
/// number of rays for its visibility.
inline constexpr double kSmallElement = 1.0 / 16;
inline constexpr std::uint32_t kSightRays = 64;

/// The surface of a scene, cut so finely that patches can be merged from its triangles.
struct CutSurface {
  Scene scene;
  std::vector<TriangleSides> sides;  ///< of each triangle of `scene`
  LampLight lamp_light;
  std::size_t sliver_count = 0;  ///< triangles thinner than the precision of rays, dropped
  std::size_t original_triangle_count = 0;  ///< before any cut, without slivers
};

/// Drops slivers, cuts triangles where others touch them (contact_cuts.h), finds their lit sides
/// (lit_sides.h), and bisects those that are large beside a patch (subdivision.h), are covered in
/// part (covers.h), or lie where the light of the scene's lamps varies (lamp_light.h). Throws Error
/// if nothing but slivers is there or no side is lit, Cancelled if asked to stop.
CutSurface cut_surface(Scene scene, const SubdivisionSettings& settings,
                       const Progress& progress = {});

/// Throws Error: no side of `scene` is lit.
[[noreturn]] void refuse_unlit_scene(const Scene& scene);

}  // namespace rebounce
