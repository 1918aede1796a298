#include "runtime/demo/bake/subdivided_mesh.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

namespace rebounce {
namespace {

// Divides the triangles of one material after another.
class Subdivider {
 public:
  Subdivider(const DisplayMesh& mesh, SubdividedMesh& out) : mesh_(mesh), out_(out) {}

  // Triangles that follow are divided into `divisions`² each.
  void begin_part(std::uint32_t material, bool is_whole, int divisions) {
    shared_.clear();
    divisions_ = divisions;
    out_.part.push_back({.material = material,
                         .is_whole = is_whole,
                         .triangle_begin = triangle_count(),
                         .triangle_end = triangle_count(),
                         .vertex_begin = vertex_count(),
                         .vertex_end = vertex_count()});
  }

  void add(std::uint32_t display) {
    const int n = divisions_;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n - j; ++i) {
        add_triangle(display, {{{i, j}, {i + 1, j}, {i, j + 1}}});
        if (i + j + 1 < n) add_triangle(display, {{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}});
      }
    }
    out_.part.back().triangle_end = triangle_count();
    out_.part.back().vertex_end = vertex_count();
  }

 private:
  // Steps from the first corner towards the second and the third.
  using Step = std::array<int, 2>;
  // A vertex is identified by the corners of the display mesh around it and its steps from them.
  // These are equal on both sides of an edge.
  using Key = std::array<std::pair<std::uint32_t, int>, 3>;

  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(out_.triangle.size()); }
  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(out_.vertex.size()); }

  glm::vec3 weight_of(const Step& step) const {
    return glm::vec3(divisions_ - step[0] - step[1], step[0], step[1]) /
           static_cast<float>(divisions_);
  }

  std::uint32_t vertex_at(std::uint32_t display, const Step& step) {
    const Uint3& corner = mesh_.triangle[display];
    const std::array<int, 3> steps = {divisions_ - step[0] - step[1], step[0], step[1]};
    Key key;
    for (std::size_t k = 0; k < 3; ++k) {
      key[k] = {steps[k] > 0 ? corner[k] : kNone, steps[k]};
    }
    std::ranges::sort(key);
    const auto [at, is_new] = shared_.try_emplace(key, vertex_count());
    if (is_new) out_.vertex.push_back({.triangle = display, .weight = weight_of(step)});
    return at->second;
  }

  void add_triangle(std::uint32_t display, const std::array<Step, 3>& step) {
    Uint3 triangle{};
    std::array<glm::vec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      triangle[k] = vertex_at(display, step[k]);
      corner[k] = weight_of(step[k]);
    }
    out_.triangle.push_back(triangle);
    out_.display.push_back(display);
    out_.corner.push_back(corner);
  }

  const DisplayMesh& mesh_;
  int divisions_ = 1;
  SubdividedMesh& out_;
  std::map<Key, std::uint32_t> shared_;
};

}  // namespace

SubdividedMesh subdivide(const DisplayMesh& mesh, int divisions,
                         std::span<const std::uint8_t> whole) {
  // The material of a part and whether it is whole, in the order of the parts.
  const auto part_of = [&](std::uint32_t t) {
    return std::pair(mesh.triangle_material[t], !whole.empty() && whole[t] != 0);
  };
  std::vector<std::uint32_t> order(mesh.triangle.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, part_of);
  SubdividedMesh out;
  Subdivider subdivider(mesh, out);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto [material, is_whole] = part_of(order[k]);
    if (k == 0 || part_of(order[k]) != part_of(order[k - 1])) {
      subdivider.begin_part(material, is_whole, is_whole ? 1 : divisions);
    }
    subdivider.add(order[k]);
  }
  return out;
}

}  // namespace rebounce
