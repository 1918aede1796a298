#pragma once

#include <glm/mat4x4.hpp>
#include <optional>

#include "precompute/import/gltf_accessors.h"

namespace rebounce::gltf {

/// The places of a node's mesh (EXT_mesh_gpu_instancing), in the node's own space.
struct Instances {
  std::size_t count = 1;
  std::optional<FloatElements> translation;  ///< [count][3]
  std::optional<FloatElements> rotation;     ///< [count][4] quaternions x, y, z, w
  std::optional<FloatElements> scale;        ///< [count][3]

  /// From instance `i`, below `count`, to the node's space.
  glm::dmat4 transform(std::size_t i) const;
};

/// Reads a node's instances: one without a transform where it does not use the extension. Throws
/// Error, which names the node, for attributes of other types or of different length.
Instances read_instances(const Document& document, std::size_t node);

}  // namespace rebounce::gltf
