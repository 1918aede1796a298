#pragma once

#include <cstdint>
#include <string>

namespace rebounce {

/// Shadow maps of a lamp with a surface.
inline constexpr std::uint32_t kLampPlaceCount = 16;

namespace shaders {

/// GLSL that adds the light of one lamp: the irradiance of its kind (lamp_kind.h) times the
/// fraction that the shadow maps let through.
std::string lamp_fragment();

}  // namespace shaders
}  // namespace rebounce
