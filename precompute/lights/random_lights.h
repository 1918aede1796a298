#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "rebounce/scene_data.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The kinds of light that the error of an operator is measured under.
enum class LightKind : std::uint8_t {
  kPoint,  ///< a point light in the free space of the scene
  kSpot,   ///< a point light with a cone of 10 to 60 degrees around an axis in any direction
  kPatch,  ///< one patch that emits, drawn by area
  kSky,    ///< in an open scene: first a uniform sky, then suns in any direction
};

inline constexpr std::array kLightKinds{LightKind::kPoint, LightKind::kSpot, LightKind::kPatch,
                                        LightKind::kSky};

/// "point", "spot", "patch", "sky".
std::string_view name(LightKind kind);

/// `count` point lights at random places in the free space of the scene. Each lies on a
/// cosine-distributed ray from a random place of the surface, between a tenth and nine tenths of
/// the way to the next surface and, where there is room, a mean patch size away from both ends.
/// With `roles`, the rays begin on sources. The same `seed` gives the same lights.
std::vector<Light> random_point_lights(const TransferData& data, const RayTracer& tracer, int count,
                                       std::uint64_t seed, const PatchRoles& roles = {});

/// The initial exitances [at most count][n] in lx of `count` random lights of a kind, one light at
/// a time; 0 for patches that are no sources. Lights that reach no source are left out, which can
/// be all of them.
std::vector<std::vector<Float3>> random_initial_exitances(const TransferData& data,
                                                          const RayTracer& tracer, LightKind kind,
                                                          int count, std::uint64_t seed,
                                                          const PatchRoles& roles = {});

/// True if at most a millionth of the light arrives anywhere, as for a lamp inside a box. No error
/// can be relative to such a light; it is left out of the errors of operators and of form factors
/// by this rule.
///
/// `exitance` is the initial exitance, or the whole radiosity if `irradiance` is what it gathers:
/// for such a light the two are nearly equal. All in lx, [n]; `area` in m².
bool arrives_nowhere(std::span<const Float3> irradiance, std::span<const Float3> exitance,
                     std::span<const float> area);

}  // namespace rebounce
