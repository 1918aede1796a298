#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// Linear Rec.709, rows from the top. Emitters and sky are drawn at most twice as bright as the
/// exposure's white, so that their edges are smooth.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Float3> pixel{};  ///< [height][width] cd/m², or a colour in [0, 1]
  float exposure = 0;           ///< stops; the tone curve takes pixel x 2^exposure
  /// Pixels are final colours (patches, error): no exposure, no tone curve.
  bool display_referred = false;
};

/// 8-bit sRGB, rows from the top.
struct ScreenImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb{};  ///< [height][width][3]
};

}  // namespace rebounce
