#pragma once

#include <glm/mat4x4.hpp>
#include <optional>

#include "precompute/import/gltf_accessors.h"

namespace rebounce::gltf {

/// The instances of the mesh of a node (EXT_mesh_gpu_instancing), in the space of the node.
struct Instances {
  std::size_t count = 1;
  std::optional<FloatElements> translation;  ///< [count][3]
  std::optional<FloatElements> rotation;     ///< [count][4] quaternions x, y, z, w
  std::optional<FloatElements> scale;        ///< [count][3]

  /// The transform from instance `i`, below `count`, to the space of the node.
  glm::dmat4 transform(std::size_t i) const;
};

/// Reads the instances of a node; a node without the extension has one instance without a
/// transform. Throws Error, which names the node, for attributes of other types or of different
/// lengths.
Instances read_instances(const Document& document, std::size_t node);

}  // namespace rebounce::gltf
