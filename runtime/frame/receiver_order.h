#pragma once

// An order of receiving patches, and bounds of what follows each other in it.

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/lamp_shadows.h"
#include "runtime/rays/box.h"

namespace rebounce {

/// Where points of surfaces lie and how they face.
struct ReceiverBounds {
  Box box;                                                      ///< of the points
  Box normals;                                                  ///< of their normals
  float lowest_plane = std::numeric_limits<float>::infinity();  ///< least dot(normal, position)

  void add(const LitPoint& point);

  /// False if nothing of `lamp` arrives at any of the points, whatever is in between: they are out
  /// of its range or its cone, or face away from it. Never wrong by rounding; there must be a
  /// point.
  bool may_receive(const PreparedLight& lamp) const;
};

/// An order of patches, given by a point of each, in which those that lie near each other and face
/// similar ways follow each other, also within pieces of `piece`, which are told apart before they
/// are ordered. The result depends on the points alone.
std::vector<std::uint32_t> receiver_order(std::span<const LitPoint> patch, std::size_t piece);

}  // namespace rebounce
