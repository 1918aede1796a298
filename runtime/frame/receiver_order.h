#pragma once

// An order of the patches that receive light, and bounds of runs of patches in it.

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

  /// False if no light of `lamp` arrives at any of the points, even if nothing is in between: they
  /// are out of its range or its cone, or face away from it. Rounding never makes it false. There
  /// must be a point.
  bool may_receive(const PreparedLight& lamp) const;
};

/// An order of patches in which those that lie near each other and face similar ways follow each
/// other. A patch is given by one of its points. Runs of `piece` patches are chosen first, then
/// ordered within. The result depends on the points alone.
std::vector<std::uint32_t> receiver_order(std::span<const LitPoint> patch, std::size_t piece);

}  // namespace rebounce
