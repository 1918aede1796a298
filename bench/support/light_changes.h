#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// The light before and after a change: what patches give off first, [n] in lx. Before a cold start
/// there is none.
struct LightChange {
  std::string name;
  std::vector<Float3> before, after;
};

/// The name of the last change.
inline constexpr const char* kSwitched = "switched";

/// Parts of the scene's diagonal by which a lamp is moved, unless others are wanted.
inline constexpr std::array kMotions = {0.01, 0.05, 0.2};

/// The types of lamp that have a place.
inline constexpr std::array kLampTypes = {LightType::kPoint, LightType::kSpot, LightType::kSphere,
                                          LightType::kRectangle, LightType::kDisc};

/// A lamp of `type` where the lamp `place` is, in a scene with that diagonal (metres), as bright
/// along its axis. Spheres and discs have 0.5 % of the diagonal as radius, rectangles 2 by 1 %. A
/// spot has a cone of 40 degrees from axis to edge, half of it full. Spots, rectangles and discs
/// shine towards `target`.
Light lamp_of_type(LightType type, const Light& place, const Float3& target, double diagonal);

/// One lamp in the free space of the scene, of those that `seed` draws: switched on in the dark,
/// moved by these parts of the scene's diagonal ("moved 1 %"; each in (0, 0.2]), and replaced by
/// another one elsewhere ("switched"), towards which it moved. It is of `type`, and what shines one
/// way only shines towards a patch that `seed` draws, wherever the lamp is. Of the light that
/// patches give off, a tenth or more arrives at others: errors are relative to what is reflected
/// then. Throws Error if no lamp does that.
std::vector<LightChange> light_changes(const TransferData& data,
                                       std::span<const double> motions = kMotions,
                                       std::uint64_t seed = 1, LightType type = LightType::kPoint);

/// What the patches give off first, M0 [n] in lx, under one lamp. Throws Error if that is nothing.
std::vector<Float3> light_of(const Light& lamp, const TransferData& data, DirectLighting& direct);

/// `count` point lights of 1 cd in the free space of the scene (random_point_lights), without those
/// that light less than a twentieth of its surface, as from inside of a box. The same `seed`, the
/// same lamps. Throws Error if there are none.
std::vector<Light> lamps_in_the_open(const TransferData& data, const RayTracer& tracer, int count,
                                     std::uint64_t seed);

/// Lamps of which the first ones change between two places, so that every frame finds them moved.
struct MovingLamps {
  std::vector<Light> lamps, elsewhere;  ///< `elsewhere`: one for each that moves

  /// Those of the next frame.
  std::span<const Light> next() {
    std::ranges::swap_ranges(elsewhere, std::span(lamps).first(elsewhere.size()));
    return lamps;
  }
};

/// True if nothing stands between two places.
bool free_way(const RayTracer& tracer, const Float3& from, const Float3& to);

}  // namespace rebounce::bench
