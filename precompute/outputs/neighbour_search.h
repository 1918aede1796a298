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

/// Patches that give to a vertex, at most.
inline constexpr std::size_t kMostSites = 16;

/// A patch with less than this part of its view in the open gives nothing: what little is left of
/// it is too noisy to show.
inline constexpr float kMostlyCovered = 0.9F;

/// What a patch gives to one vertex.
struct ReconstructionSite {
  std::uint32_t patch;
  float weight;
  float distance_squared;  ///< of its nearest sample
  glm::vec3 position;      ///< of that sample
  glm::vec3 normal;
};

/// A vertex that looks for patches around it.
struct Receiver {
  glm::vec3 position{0};
  glm::vec3 normal{0};    ///< unit, area-weighted over its triangles
  glm::vec3 inset{0};     ///< a point of its largest triangle, clear of the surfaces at its edges
  float reach = 0;        ///< metres
  bool is_shown = false;  ///< some triangle of it shows a patch
};

/// Finds the patches around vertices by points that stand for them. Immutable, usable from any
/// number of threads.
class NeighbourSearch {
 public:
  /// Room for the work of find(), one for each thread.
  class Scratch {
   public:
    explicit Scratch(const NeighbourSearch& search) : slot_(search.patch_count(), kNone) {}

   private:
    friend class NeighbourSearch;
    std::vector<PointFinder::Found> found_;
    std::vector<std::uint32_t> slot_;  ///< [n] place of a patch among the candidates, or kNone
    std::vector<ReconstructionSite> candidates_;
    std::vector<Ray> rays_;
    std::vector<std::uint8_t> in_sight_;  ///< of each candidate
  };

  /// `area` (m²) and `absorbed` (part of the view) are of each patch. All must outlive it.
  NeighbourSearch(const DisplayMesh& mesh, const PatchTriangles& triangles,
                  std::span<const float> area, std::span<const float> absorbed,
                  const RayTracer& tracer);

  std::size_t patch_count() const { return absorbed_.size(); }

  /// The patches with samples within `reach` metres of a vertex that face as it does, about in its
  /// plane and in sight (`own` patches always are): the heaviest kMostSites of them, ascending.
  /// The weight is area x (1 - r²/R²)². Where surfaces are folded close together the reach is less,
  /// and of what hides behind something only the heaviest is looked at.
  std::vector<ReconstructionSite> find(const Receiver& receiver, std::span<const std::uint32_t> own,
                                       float reach, Scratch& scratch) const;

 private:
  struct Sample {
    glm::vec3 position{0}, normal{0};
    std::uint32_t patch = kNone;
    float share = 0;  ///< of area
  };

  void find_candidates(const Receiver& receiver, float reach, Scratch& scratch) const;
  void add(const Sample& sample, float distance_squared, float reach, Scratch& scratch) const;
  void look_at_next(const Receiver& receiver, std::size_t begin, std::size_t end,
                    std::span<const std::uint32_t> own, Scratch& scratch) const;

  std::span<const float> absorbed_;
  const RayTracer& tracer_;
  std::vector<Sample> samples_;    ///< [n][16]
  std::vector<Float3> positions_;  ///< theirs
  std::optional<PointFinder> finder_;
};

}  // namespace rebounce
