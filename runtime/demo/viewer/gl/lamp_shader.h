#pragma once

#include <cstdint>
#include <string>

namespace rebounce {

/// Places on a lamp with a surface from which its shadows are seen.
inline constexpr std::uint32_t kLampPlaceCount = 16;

namespace shaders {

/// GLSL that adds one lamp to what is there: the light that its kind (lamp_kind.h) says, times what
/// shadow maps let through.
std::string lamp_fragment();

}  // namespace shaders
}  // namespace rebounce
