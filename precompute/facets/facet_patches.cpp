#include "precompute/facets/facet_patches.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "precompute/patches/subdivision.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// Facets longer than this number of median facets are cut even where there are many.
constexpr double kLargeFacet = 6;

// A facet of at most this number of triangles is one patch unless it is cut: kernels between few
// triangles are exact.
constexpr std::size_t kTrianglesOfPatch = 2;

/// The facets as a scene without materials, triangle by triangle.
class FacetScene {
 public:
  explicit FacetScene(const Facets& facets) : facets_(facets) {
    add_vertices();
    for (std::size_t k = 0; k < facets.size(); ++k) add_facet(k);
  }

  Scene& scene() { return scene_; }
  std::uint32_t facet(std::uint32_t triangle) const { return triangle_facet_[triangle]; }

 private:
  void add_vertices() {
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (const std::uint32_t v : facets_.corner) {
      low = glm::min(low, facets_.vertex[v]);
      high = glm::max(high, facets_.vertex[v]);
    }
    // Single precision is finest around the origin.
    const glm::dvec3 middle = 0.5 * (low + high);
    const std::size_t count = facets_.vertex.size();
    scene_.position.resize(count, Float3{0, 0, 0});  // vertices without a facet stay there
    for (const std::uint32_t v : facets_.corner) {
      scene_.position[v] = to_float3(facets_.vertex[v] - middle);
    }
    scene_.normal.resize(count, Float3{0, 0, 1});
    scene_.base_color_texcoord.resize(count, Float2{0, 0});
    scene_.emissive_texcoord.resize(count, Float2{0, 0});
    scene_.vertex_color.resize(count, Float3{1, 1, 1});
    scene_.materials.resize(1);
  }

  /// The corners of a facet without those that repeat the one before.
  std::vector<std::uint32_t> distinct_corners(std::size_t facet) const {
    const auto at = [&](std::uint32_t v) { return facets_.vertex[v]; };
    std::vector<std::uint32_t> distinct;
    for (const std::uint32_t v : facets_.corners(facet)) {
      if (distinct.empty() || at(v) != at(distinct.back())) distinct.push_back(v);
    }
    while (at(distinct.back()) == at(distinct.front())) distinct.pop_back();
    return distinct;
  }

  /// Whether a triangle has an area in single precision. ConformingMesh takes no others.
  bool has_area(const Uint3& corner) const {
    const auto at = [&](std::uint32_t v) { return to_dvec3(scene_.position[v]); };
    return area_of({at(corner[0]), at(corner[1]), at(corner[2])}) > 0;
  }

  void add_facet(std::size_t facet) {
    const std::vector<std::uint32_t> index = distinct_corners(facet);
    std::vector<glm::dvec3> corner;
    for (const std::uint32_t v : index) corner.push_back(facets_.vertex[v]);
    const auto triangles = triangulate(corner, glm::normalize(facets_.vector_area(facet)));
    if (triangles.empty()) refuse_facet(facet, "crosses itself; cut it into triangles");
    const std::size_t before = scene_.triangle.size();
    for (const auto& t : triangles) {
      const Uint3 triangle = {index[t[0]], index[t[1]], index[t[2]]};
      if (!has_area(triangle)) continue;
      scene_.triangle.push_back(triangle);
      scene_.triangle_material.push_back(0);
      triangle_facet_.push_back(static_cast<std::uint32_t>(facet));
    }
    if (scene_.triangle.size() == before) {
      refuse_facet(facet, "is too thin for single precision; remove it");
    }
  }

  const Facets& facets_;
  Scene scene_;
  std::vector<std::uint32_t> triangle_facet_;
};

/// The longest edge that patches may have: about `least_count` patches have none that is longer,
/// and no facet is cut for being a little larger than others.
float longest_edge(const Facets& facets, std::size_t least_count) {
  std::vector<double> area;
  double sum = 0;
  for (std::size_t k = 0; k < facets.size(); ++k) {
    area.push_back(glm::length(facets.vector_area(k)));
    sum += area.back();
  }
  const double by_count = 2 * std::sqrt(sum / static_cast<double>(least_count));
  if (facets.size() < least_count) return static_cast<float>(by_count);
  const auto middle = area.begin() + static_cast<std::ptrdiff_t>(area.size() / 2);
  std::ranges::nth_element(area, middle);
  return static_cast<float>(std::max(by_count, kLargeFacet * std::sqrt(*middle)));
}

}  // namespace

FacetPatches make_facet_patches(const Facets& facets, std::size_t least_count) {
  FacetScene whole(facets);
  Scene& scene = whole.scene();
  std::vector<std::uint32_t> source(scene.triangle.size());
  std::iota(source.begin(), source.end(), 0U);
  // Two facets hide nothing from each other.
  if (facets.size() > 2) {
    const std::vector<std::uint8_t> one_each(scene.triangle.size(), 1);
    source = subdivide(scene, one_each,
                       {.patch_count = 0, .patch_size = longest_edge(facets, least_count)});
  }

  FacetPatches result;
  DisplayMesh& mesh = result.model.mesh;
  mesh.position = std::move(scene.position);
  mesh.triangle = std::move(scene.triangle);
  const std::size_t count = mesh.triangle.size();
  mesh.back_triangle.assign(count, kNone);
  mesh.triangle_patch.assign(count, kNone);
  for (std::size_t first = 0, end = 0; first < count; first = end) {
    const std::uint32_t facet = whole.facet(source[first]);
    while (end < count && whole.facet(source[end]) == facet) ++end;
    if (!facets.exchanges(facet)) continue;
    const bool whole_patch = end - first <= kTrianglesOfPatch;
    for (std::size_t t = first; t < end; ++t) {
      if (t == first || !whole_patch) result.patch_facet.push_back(facet);
      mesh.triangle_patch[t] = static_cast<std::uint32_t>(result.patch_facet.size() - 1);
    }
  }
  result.model.shown_patch = mesh.triangle_patch;
  result.model.patches.area.resize(result.patch_facet.size());  // the table's size is n
  return result;
}

}  // namespace rebounce
