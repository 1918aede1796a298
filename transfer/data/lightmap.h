#pragma once

#include <cstdint>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// One texture for the light of all display triangles that have a place in it, as a sparse linear
/// map: the value of a texel is that of a place on the display mesh, interpolated between the
/// vertices of its triangle, whose values are in turn a linear map of the patches'
/// (DisplayMesh::weight). Texels around a chart continue it, for filters that reach over its rim.
struct Lightmap {
  std::uint32_t width = 0, height = 0;  ///< texels; zeros: there is no lightmap
  /// [v] of the display mesh, in [0, 1], (0, 0) the upper left corner of the texture; (0, 0) where
  /// a vertex has no place.
  std::vector<Float2> texcoord;
  std::vector<std::uint8_t> has_texels;  ///< [t] 1 for display triangles that have a place
  std::vector<std::uint32_t> triangle;   ///< [height][width] display triangle, or kNone
  std::vector<Float2> weight;  ///< [height][width] barycentric, of its second and third vertex

  bool empty() const { return width == 0; }
};

}  // namespace rebounce
