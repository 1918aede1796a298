#pragma once

#include <glm/mat4x4.hpp>
#include <vector>

#include "gltf_document.h"

namespace rebounce::gltf {

/// A node of the scene and where it stands.
struct PlacedNode {
  std::size_t node = 0;   ///< index in the model's nodes
  glm::dmat4 world{1.0};  ///< from the node's space to the world
};

/// The nodes of the default scene (the first where none is named, every root node where there are
/// no scenes), parents before children, siblings in order. Throws Error where a node is reached
/// twice, which includes every cycle.
std::vector<PlacedNode> place_nodes(const tinygltf::Model& model);

}  // namespace rebounce::gltf
