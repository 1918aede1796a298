#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "precompute/sampling/point_finder.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The largest number of patches that contribute to a vertex.
inline constexpr std::size_t kMostSites = 16;

/// A patch with more than this fraction of its view absorbed contributes nothing: the small rest is
/// too noisy to show.
inline constexpr float kMostlyCovered = 0.9F;

/// The contribution of a patch to one vertex.
struct ReconstructionSite {
  std::uint32_t patch;
  float weight;
  float distance_squared;  ///< of its nearest sample, m²
  glm::vec3 position;      ///< of that sample
  glm::vec3 normal;
};

/// A vertex that looks for patches around it.
struct Receiver {
  glm::vec3 position{0};
  glm::vec3 normal{0};    ///< unit, area-weighted over its triangles
  glm::vec3 inset{0};     ///< a point of its largest triangle, away from the surfaces at its edges
  float reach = 0;        ///< metres
  bool is_shown = false;  ///< some triangle of the vertex shows a patch
};

/// Finds the patches around vertices by points that represent them. Immutable, usable from any
/// number of threads.
class NeighbourSearch {
 public:
  /// Memory of find(), one for each thread.
  class Scratch {
   public:
    explicit Scratch(const NeighbourSearch& search) : slot_(search.patch_count(), kNone) {}

   private:
    friend class NeighbourSearch;
    std::vector<PointFinder::Found> found_;
    std::vector<std::uint32_t> slot_;  ///< [n] index of a patch among the candidates, or kNone
    std::vector<ReconstructionSite> candidates_;
    std::vector<Ray> rays_;
    std::vector<std::uint8_t> in_sight_;  ///< by candidate
  };

  /// `area` (m²) and `absorbed` (fraction of the view) are by patch. All arguments must outlive the
  /// object.
  NeighbourSearch(const DisplayMesh& mesh, const PatchTriangles& triangles,
                  std::span<const float> area, std::span<const float> absorbed,
                  const RayTracer& tracer);

  std::size_t patch_count() const { return absorbed_.size(); }

  /// The patches with samples within `reach` metres of a vertex that face the same way, lie about
  /// in its plane and are visible (`own` patches always are): the kMostSites with the largest
  /// weights, ascending. The weight is area x (1 - r²/R²)². Where surfaces are folded close
  /// together the reach is reduced, and only the candidates with the largest weights are tested for
  /// visibility.
  std::vector<ReconstructionSite> find(const Receiver& receiver, std::span<const std::uint32_t> own,
                                       float reach, Scratch& scratch) const;

 private:
  struct Sample {
    glm::vec3 position{0}, normal{0};
    std::uint32_t patch = kNone;
    float share = 0;  ///< of the area
  };

  void find_candidates(const Receiver& receiver, float reach, Scratch& scratch) const;
  void add(const Sample& sample, float distance_squared, float reach, Scratch& scratch) const;
  void look_at_next(const Receiver& receiver, std::size_t begin, std::size_t end,
                    std::span<const std::uint32_t> own, Scratch& scratch) const;

  std::span<const float> absorbed_;
  const RayTracer& tracer_;
  std::vector<Sample> samples_;    ///< [n][16]
  std::vector<Float3> positions_;  ///< places of the samples
  std::optional<PointFinder> finder_;
};

}  // namespace rebounce
