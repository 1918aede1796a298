#include "precompute/import/gltf_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

// The limit of placed nodes. A node with several parents is placed several times, and so are its
// children, so that a small file could fill the memory.
constexpr std::size_t kMaxPlacedNodes = std::size_t{1} << 20;

glm::dmat4 local_transform(const tinygltf::Node& node) {
  if (!node.matrix.empty()) return glm::make_mat4(node.matrix.data());
  Trs trs;
  if (!node.translation.empty()) trs.translation = glm::make_vec3(node.translation.data());
  if (!node.rotation.empty()) trs.rotation = glm::make_vec4(node.rotation.data());
  if (!node.scale.empty()) trs.scale = glm::make_vec3(node.scale.data());
  return trs.matrix();
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

// Walks the hierarchy depth first with an explicit stack, because its depth is not limited.
class Traversal {
 public:
  explicit Traversal(const tinygltf::Model& model)
      : model_(model), is_root_(model.nodes.size(), false), is_open_(model.nodes.size(), false) {}

  std::vector<PlacedNode> run(const glm::dmat4& world) {
    const std::vector<int> roots = root_nodes(model_);
    for (const int root : roots) mark_root(static_cast<std::size_t>(root));
    push(roots, world);
    while (!pending_.empty()) {
      Step step = pending_.back();
      pending_.pop_back();
      if (step.leaves) {
        is_open_[step.placed.node] = false;
      } else {
        enter(step.placed);
      }
    }
    return std::move(placed_);
  }

 private:
  struct Step {
    PlacedNode placed;  ///< `world` is still that of the parent
    bool leaves;        ///< visited after the last descendant of the node
  };

  void mark_root(std::size_t node) {
    if (is_root_[node]) {
      throw Error(fmt::format("nodes[{}] is reached twice: the scene lists it twice", node));
    }
    is_root_[node] = true;
  }

  void push(const std::vector<int>& nodes, const glm::dmat4& parent) {
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
      pending_.push_back({{static_cast<std::size_t>(*node), parent}, false});
    }
  }

  void enter(PlacedNode next) {
    if (is_open_[next.node]) {
      throw Error(
          fmt::format("nodes[{}] is its own ancestor: the hierarchy has a cycle", next.node));
    }
    if (placed_.size() == kMaxPlacedNodes) {
      throw Error(fmt::format("the hierarchy unfolds to more than {} nodes", kMaxPlacedNodes));
    }
    const tinygltf::Node& node = model_.nodes[next.node];
    for (const int child : node.children) {
      if (!is_root_[static_cast<std::size_t>(child)]) continue;
      throw Error(fmt::format(
          "nodes[{}] is reached twice: it is a root of the scene and a child of nodes[{}]", child,
          next.node));
    }
    next.world *= local_transform(node);
    is_open_[next.node] = true;
    pending_.push_back({next, true});
    push(node.children, next.world);
    placed_.push_back(next);
  }

  const tinygltf::Model& model_;
  std::vector<bool> is_root_;
  // Nodes that are entered and not left: the ancestors of the current node.
  std::vector<bool> is_open_;
  std::vector<Step> pending_;
  std::vector<PlacedNode> placed_;
};

}  // namespace

glm::dmat4 Trs::matrix() const {
  glm::dmat4 transform = glm::translate(glm::dmat4(1.0), translation);
  const glm::dquat quaternion(rotation.w, rotation.x, rotation.y, rotation.z);
  // Exporters round: without this a rotation would scale. A quaternion of zero is no rotation.
  const double length = glm::length(quaternion);
  if (length > 0) transform *= glm::mat4_cast(quaternion / length);
  return glm::scale(transform, scale);
}

std::vector<PlacedNode> place_nodes(const tinygltf::Model& model, double scale) {
  return Traversal(model).run(glm::scale(glm::dmat4(1.0), glm::dvec3(scale)));
}

}  // namespace rebounce::gltf
