#include "runtime/demo/picture/view_score.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "runtime/demo/shading/display_surface.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

constexpr float kCellsPerEyeHeight = 3;
constexpr float kNear = 1.25F;  // of the eye's height
// What is seen through culled faces alone still counts for something, where there is nothing else.
constexpr float kCulled = 0.98F;

// A piece of surface. Background is the one of material kNone.
struct Piece {
  std::uint32_t material = kNone;
  int orientation = 0;  // of the six along the axes
  glm::ivec3 cell{0, 0, 0};

  bool is_like(const Piece& other) const {
    return material == other.material && orientation == other.orientation;
  }
  bool is_same(const Piece& other) const { return is_like(other) && cell == other.cell; }
  friend bool operator<(const Piece& a, const Piece& b) {
    if (a.material != b.material) return a.material < b.material;
    if (a.orientation != b.orientation) return a.orientation < b.orientation;
    return std::lexicographical_compare(&a.cell.x, &a.cell.x + 3, &b.cell.x, &b.cell.x + 3);
  }
};

std::vector<Ray> rays_of_view(const Camera& camera, int columns, int rows) {
  const float extent = std::tan(0.5F * camera.vertical_fov);
  const auto across = [](int k, int count) {
    return (2 * static_cast<float>(k) + 1) / static_cast<float>(count) - 1;
  };
  std::vector<Ray> rays;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const glm::vec3 way = across(column, columns) * extent * kViewAspect * to_glm(camera.right) +
                            across(row, rows) * extent * to_glm(camera.up) -
                            to_glm(camera.backward);
      rays.push_back({.origin = camera.position,
                      .t_near = 0,
                      .direction = to_float3(glm::normalize(way)),
                      .t_far = std::numeric_limits<float>::infinity()});
    }
  }
  return rays;
}

int orientation_of(const glm::dvec3& normal) {
  const glm::dvec3 size = glm::abs(normal);
  const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  return 2 * axis + (normal[axis] > 0 ? 1 : 0);
}

// The entropy of the parts that runs of equals have of `pieces`.
template <typename IsEqual>
float entropy(const std::vector<Piece>& pieces, const IsEqual& is_equal) {
  double sum = 0;
  for (std::size_t begin = 0; begin < pieces.size();) {
    std::size_t end = begin + 1;
    while (end < pieces.size() && std::invoke(is_equal, pieces[begin], pieces[end])) ++end;
    const double part = static_cast<double>(end - begin) / static_cast<double>(pieces.size());
    sum -= part * std::log(part);
    begin = end;
  }
  return static_cast<float>(sum);
}

}  // namespace

float view_score(const Camera& camera, const DisplayMesh& mesh, const RayTracer& tracer,
                 float eye_height, int columns, int rows) {
  std::vector<Ray> rays = rays_of_view(camera, columns, rows);
  std::vector<Hit> hits(rays.size());
  intersect_visible(tracer, mesh, rays, hits);
  std::vector<Piece> pieces(hits.size());
  float culled = 0, unlit = 0, near = 0;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    const Hit& hit = hits[k];
    if (rays[k].t_near > 0) ++culled;
    if (hit.triangle == kNone) continue;
    const std::uint32_t side = hit.front ? hit.triangle : mesh.back_triangle[hit.triangle];
    if (mesh.triangle_patch[side] == kNone) ++unlit;
    near += std::max(0.0F, 1 - hit.t / (kNear * eye_height));
    const glm::vec3 place = to_glm(rays[k].origin) + hit.t * to_glm(rays[k].direction);
    pieces[k] = {.material = mesh.triangle_material[side],
                 .orientation = orientation_of(front_normal(corners_of(mesh, side))),
                 .cell = glm::floor(place * (kCellsPerEyeHeight / eye_height))};
  }
  std::sort(pieces.begin(), pieces.end());
  const auto part_without = [&](float count) {
    return 1 - count / static_cast<float>(hits.size());
  };
  const float through = part_without(kCulled * culled), far = part_without(near);
  return (entropy(pieces, &Piece::is_same) + 0.5F * entropy(pieces, &Piece::is_like)) * through *
         through * far * far * part_without(unlit);
}

}  // namespace rebounce
