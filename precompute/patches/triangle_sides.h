#pragma once

#include <cstdint>

namespace rebounce {

/// What a side of a triangle is to the exchange of light.
enum class SideKind : std::uint8_t {
  kLit,      ///< it has a patch
  kUnlit,    ///< it sees nothing that lights it, or is the back of a one-sided triangle
  kCovered,  ///< another triangle that faces the same way lies in the same place, and has the patch
  kBuried,   ///< it lies inside of something solid, or of a closed shell
  kOpening,  ///< light passes through it as if nothing were there
};

/// Front and back of one triangle.
struct TriangleSides {
  SideKind front = SideKind::kLit;
  SideKind back = SideKind::kUnlit;

  int patch_count() const { return (front == SideKind::kLit) + (back == SideKind::kLit); }
};

}  // namespace rebounce
