#pragma once

#include <glm/mat4x4.hpp>
#include <vector>

#include "precompute/import/gltf_document.h"

namespace rebounce::gltf {

/// A node of the scene and where it stands.
struct PlacedNode {
  std::size_t node = 0;   ///< index in the model's nodes
  glm::dmat4 world{1.0};  ///< from the node's space to the world
};

/// A transform in glTF's parts, applied from the last to the first.
struct Trs {
  glm::dvec3 translation{0.0};
  glm::dvec4 rotation{0.0, 0.0, 0.0, 1.0};  ///< quaternion x, y, z, w of any length; 0: none
  glm::dvec3 scale{1.0};

  glm::dmat4 matrix() const;
};

/// The nodes of the default scene (the first where none is named, every root node where there are
/// no scenes), parents before children, siblings in order. A node with several parents, which glTF
/// forbids and exporters write, stands below each of them. Throws Error where a node is its own
/// ancestor, a root more than once, or both a root and a child. `scale`
/// turns the asset's unit into metres.
std::vector<PlacedNode> place_nodes(const tinygltf::Model& model, double scale);

}  // namespace rebounce::gltf
