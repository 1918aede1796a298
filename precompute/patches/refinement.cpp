#include "precompute/patches/refinement.h"

#include <algorithm>
#include <glm/glm.hpp>
#include <numeric>

#include "precompute/patches/longest_edges.h"

namespace rebounce {
namespace {

using EdgeKey = ConformingMesh::EdgeKey;

class Refinement {
 public:
  Refinement(Scene& scene, const IsCoarse& is_coarse)
      : scene_(scene), mesh_(scene), is_coarse_(is_coarse) {}

  void run(std::size_t most_added) {
    const std::size_t most = mesh_.triangle_count() + most_added;
    std::vector<std::uint32_t> suspects(mesh_.triangle_count());
    std::iota(suspects.begin(), suspects.end(), 0U);
    while (!suspects.empty() && mesh_.triangle_count() < most) {
      std::vector<std::uint32_t> coarse = find_coarse(suspects);
      suspects.clear();
      // The largest come first; the smallest are left if there are enough triangles.
      std::ranges::stable_sort(coarse, [this](std::uint32_t a, std::uint32_t b) {
        return longest_squared(a) > longest_squared(b);
      });
      is_new_.assign(mesh_.triangle_count(), 0);
      for (const std::uint32_t t : coarse) {
        if (is_new_[t] == 0 && mesh_.triangle_count() < most) bisect(t, suspects);
      }
    }
  }

  std::vector<std::uint32_t> finish() { return mesh_.finish(); }

 private:
  float longest_squared(std::uint32_t t) const {
    return mesh_.length_squared(longest_edge(mesh_, t));
  }

  /// Those of `suspects` that are coarse.
  std::vector<std::uint32_t> find_coarse(const std::vector<std::uint32_t>& suspects) const {
    std::vector<std::uint8_t> found(suspects.size());
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t k = 0; k < suspects.size(); ++k) {
      const std::uint32_t t = suspects[k];
      found[k] = is_coarse_(corners_of(scene_, t), mesh_.source(t)) ? 1 : 0;
    }
    std::vector<std::uint32_t> coarse;
    for (std::size_t k = 0; k < suspects.size(); ++k) {
      if (found[k] != 0) coarse.push_back(suspects[k]);
    }
    return coarse;
  }

  /// Bisects the longest edge of a triangle, and before it the longer edges of its neighbours; adds
  /// each new triangle to `suspects` once.
  void bisect(std::uint32_t t, std::vector<std::uint32_t>& suspects) {
    const EdgeKey wanted = longest_edge(mesh_, t);
    EdgeKey key = wanted;
    do {
      key = end_of_longest_edge_path(mesh_, wanted);
      const ConformingMesh::EdgeSplit split = mesh_.split_edge(key, 0.5);
      is_new_.resize(mesh_.triangle_count(), 0);
      for (const auto& [kept, added] : split.triangles) {
        for (const std::uint32_t part : {kept, added}) {
          if (is_new_[part] == 0) suspects.push_back(part);
          is_new_[part] = 1;
        }
      }
    } while (key != wanted);
  }

  Scene& scene_;
  ConformingMesh mesh_;
  const IsCoarse& is_coarse_;
  std::vector<std::uint8_t> is_new_;  ///< of each triangle: made in this round
};

}  // namespace

std::vector<std::uint32_t> refine_where(Scene& scene, const IsCoarse& is_coarse,
                                        std::size_t most_added) {
  Refinement refinement(scene, is_coarse);
  refinement.run(most_added);
  return refinement.finish();
}

double longest_edge_length(const TriangleCorners& corners) {
  const auto length = [&](int k) { return glm::distance(corners[k], corners[(k + 1) % 3]); };
  return std::max({length(0), length(1), length(2)});
}

}  // namespace rebounce
