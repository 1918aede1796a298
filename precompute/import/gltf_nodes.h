#pragma once

#include <glm/mat4x4.hpp>
#include <vector>

#include "precompute/import/gltf_document.h"

namespace rebounce::gltf {

/// A node of the scene and its place.
struct PlacedNode {
  std::size_t node = 0;   ///< index in the model's nodes
  glm::dmat4 world{1.0};  ///< from the space of the node to the world
};

/// A transform in the parts of glTF, applied from the last to the first.
struct Trs {
  glm::dvec3 translation{0.0};
  glm::dvec4 rotation{0.0, 0.0, 0.0, 1.0};  ///< quaternion x, y, z, w of any length; 0: none
  glm::dvec3 scale{1.0};

  glm::dmat4 matrix() const;
};

/// The nodes of the default scene (the first scene if none is named, every root node if there are
/// no scenes), parents before children, siblings in order. A node with several parents, which glTF
/// forbids and exporters write, is placed below each of them. Throws Error if a node is its own
/// ancestor, or is a root twice or both a root and a child. `scale` converts the unit of the asset
/// into metres.
std::vector<PlacedNode> place_nodes(const tinygltf::Model& model, double scale);

}  // namespace rebounce::gltf
