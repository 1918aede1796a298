#pragma once

#include <cstdint>

namespace rebounce {

/// The role of a side of a triangle in the exchange of light.
enum class SideKind : std::uint8_t {
  kLit,      ///< it has a patch
  kUnlit,    ///< sees nothing that lights it, or is the back of a one-sided triangle
  kCovered,  ///< another triangle in the same place faces the same way and has the patch
  kBuried,   ///< lies inside a solid or a closed shell
  kOpening,  ///< light passes through as if nothing were there
};

/// The sides of one triangle.
struct TriangleSides {
  SideKind front = SideKind::kLit;
  SideKind back = SideKind::kUnlit;

  int patch_count() const { return (front == SideKind::kLit) + (back == SideKind::kLit); }
};

}  // namespace rebounce
