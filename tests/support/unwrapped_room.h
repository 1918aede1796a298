#pragma once

// A room that is unwrapped for a lightmap, as a glTF file.

#include <array>
#include <vector>

#include "tests/support/gltf_builder.h"

namespace rebounce::test {

using Quad = std::array<std::array<float, 3>, 4>;  ///< counter-clockwise from its front

/// Quads with a chart each, side by side in a grid over the page, with a margin of an eighth of a
/// cell. `cells` lie along each side of the page.
class QuadMesh {
 public:
  explicit QuadMesh(int cells) : cells_(cells) {}

  void add(const Quad& quad, int cell) {
    const auto first = static_cast<std::uint32_t>(position_.size() / 3);
    const float size = 1.0F / static_cast<float>(cells_);
    const std::array<std::array<float, 2>, 4> chart = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    const auto row = cell / cells_, column = cell % cells_;
    for (std::size_t k = 0; k < 4; ++k) {
      position_.insert(position_.end(), quad[k].begin(), quad[k].end());
      texcoord_.push_back(size * (static_cast<float>(column) + 0.125F + 0.75F * chart[k][0]));
      texcoord_.push_back(size * (static_cast<float>(row) + 0.125F + 0.75F * chart[k][1]));
    }
    for (const std::uint32_t k : {0U, 1U, 2U, 0U, 2U, 3U}) index_.push_back(first + k);
  }

  std::vector<float>& texcoord() { return texcoord_; }

  /// Adds the mesh and returns its number.
  int add_to(GltfBuilder& builder) const {
    const json attributes = {{"POSITION", builder.add_accessor(position_, "VEC3", 3)},
                             {"TEXCOORD_1", builder.add_accessor(texcoord_, "VEC2", 2)}};
    return builder.add_mesh(
        {{"attributes", attributes}, {"indices", builder.add_indices(index_)}, {"material", 0}});
  }

 private:
  int cells_;
  std::vector<float> position_, texcoord_;
  std::vector<std::uint32_t> index_;
};

/// A closed room of 4 x 2.5 x 3 m with a block on its floor. The floor's two halves have charts 0
/// and 1, which meet in the middle, x = 2.
inline QuadMesh unwrapped_room() {
  const float w = 4, h = 2.5F, d = 3;
  QuadMesh mesh(4);
  mesh.add({{{0, 0, d}, {2, 0, d}, {2, 0, 0}, {0, 0, 0}}}, 0);
  mesh.add({{{2, 0, d}, {w, 0, d}, {w, 0, 0}, {2, 0, 0}}}, 1);
  mesh.add({{{0, h, 0}, {w, h, 0}, {w, h, d}, {0, h, d}}}, 2);
  mesh.add({{{0, 0, 0}, {w, 0, 0}, {w, h, 0}, {0, h, 0}}}, 3);
  mesh.add({{{w, 0, d}, {0, 0, d}, {0, h, d}, {w, h, d}}}, 4);
  mesh.add({{{0, 0, d}, {0, 0, 0}, {0, h, 0}, {0, h, d}}}, 5);
  mesh.add({{{w, 0, 0}, {w, 0, d}, {w, h, d}, {w, h, 0}}}, 6);
  const float a = 2.6F, b = 3.4F, top = 0.9F, n = 0.6F, f = 1.4F;  // the block
  mesh.add({{{a, top, f}, {b, top, f}, {b, top, n}, {a, top, n}}}, 7);
  mesh.add({{{a, 0, f}, {b, 0, f}, {b, top, f}, {a, top, f}}}, 8);
  mesh.add({{{b, 0, n}, {a, 0, n}, {a, top, n}, {b, top, n}}}, 9);
  mesh.add({{{b, 0, f}, {b, 0, n}, {b, top, n}, {b, top, f}}}, 10);
  mesh.add({{{a, 0, n}, {a, 0, f}, {a, top, f}, {a, top, n}}}, 11);
  return mesh;
}

/// A file with the mesh on one node and one grey material.
inline GltfBuilder unwrapped_scene(const QuadMesh& mesh) {
  GltfBuilder builder;
  builder.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.6, 0.55, 0.5, 1}}}}});
  builder.add_node({{"mesh", mesh.add_to(builder)}});
  return builder;
}

}  // namespace rebounce::test
