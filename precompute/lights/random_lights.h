#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/rays/ray_tracer.h"
#include "transfer/data/patch_roles.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The kinds of light that an operator is measured under.
enum class LightKind : std::uint8_t {
  kPoint,  ///< a point light in the free space of the scene
  kSpot,   ///< the same with a cone of 10 to 60 degrees from its axis, in any direction
  kPatch,  ///< one patch that emits, drawn by area
  kSky,    ///< where the scene is open: first a uniform sky, then suns in any direction
};

inline constexpr std::array kLightKinds{LightKind::kPoint, LightKind::kSpot, LightKind::kPatch,
                                        LightKind::kSky};

/// "point", "spot", "patch", "sky".
std::string_view name(LightKind kind);

/// `count` point lights at random places in the free space of the scene: on the way of a
/// cosine-distributed ray from a random place of the surface to what it hits, between a tenth and
/// nine tenths of it and, where there is room, a mean patch size off both ends. With `roles`, the
/// rays begin on sources. The same `seed`, the same lights.
std::vector<Light> random_point_lights(const TransferData& data, const RayTracer& tracer, int count,
                                       std::uint64_t seed, const PatchRoles& roles = {});

/// What `count` random lights of a kind, one at a time, make the sources give off for the first
/// time: initial exitances [at most count][n] in lx, 0 for other patches. Those that reach none are
/// left out, which can be all of them.
std::vector<std::vector<Float3>> random_initial_exitances(const TransferData& data,
                                                          const RayTracer& tracer, LightKind kind,
                                                          int count, std::uint64_t seed,
                                                          const PatchRoles& roles = {});

/// Whether of what a light's patches give off a millionth at most arrives anywhere: the light is
/// none, of a lamp inside of a box, say, which only what has no front faces sees, and no error can
/// be relative to it. This is the rule by which such lights are left out of the errors of operators
/// and of form factors alike.
///
/// `exitance` is initial, or the whole radiosity where `irradiance` is what it gathers: for such a
/// light they are nearly the same. All in lx, [n]; `area` in m².
bool arrives_nowhere(std::span<const Float3> irradiance, std::span<const Float3> exitance,
                     std::span<const float> area);

}  // namespace rebounce
