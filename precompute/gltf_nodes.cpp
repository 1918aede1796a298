#include "gltf_nodes.h"

#include <fmt/format.h>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "rebounce/transfer/error.h"

namespace rebounce::gltf {
namespace {

glm::dmat4 local_transform(const tinygltf::Node& node) {
  if (!node.matrix.empty()) return glm::make_mat4(node.matrix.data());
  glm::dmat4 transform(1.0);
  if (!node.translation.empty()) {
    transform = glm::translate(transform, glm::make_vec3(node.translation.data()));
  }
  if (!node.rotation.empty()) {
    const auto& r = node.rotation;
    const glm::dquat rotation(r[3], r[0], r[1], r[2]);
    // Exporters round: without this a rotation would scale. A zero one is no rotation.
    const double length = glm::length(rotation);
    if (length > 0) transform *= glm::mat4_cast(rotation / length);
  }
  if (!node.scale.empty()) {
    transform = glm::scale(transform, glm::make_vec3(node.scale.data()));
  }
  return transform;
}

std::vector<int> root_nodes(const tinygltf::Model& model) {
  if (!model.scenes.empty()) {
    return model.scenes[static_cast<std::size_t>(std::max(model.defaultScene, 0))].nodes;
  }
  std::vector<bool> is_child(model.nodes.size(), false);
  for (const auto& node : model.nodes) {
    for (const int child : node.children) is_child[static_cast<std::size_t>(child)] = true;
  }
  std::vector<int> roots;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  }
  return roots;
}

}  // namespace

std::vector<PlacedNode> place_nodes(const tinygltf::Model& model) {
  std::vector<PlacedNode> placed;
  std::vector<PlacedNode> pending;  // a stack of our own: a hierarchy may be of any depth
  const auto push = [&](const std::vector<int>& nodes, const glm::dmat4& parent) {
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
      pending.push_back({static_cast<std::size_t>(*node), parent});
    }
  };
  push(root_nodes(model), glm::dmat4(1.0));
  std::vector<bool> reached(model.nodes.size(), false);
  while (!pending.empty()) {
    PlacedNode next = pending.back();
    pending.pop_back();
    if (reached[next.node]) {
      throw Error(
          fmt::format("nodes[{}] is reached twice: it has two parents or is its own ancestor; give "
                      "it one parent",
                      next.node));
    }
    reached[next.node] = true;
    const auto& node = model.nodes[next.node];
    next.world *= local_transform(node);
    push(node.children, next.world);
    placed.push_back(next);
  }
  return placed;
}

}  // namespace rebounce::gltf
