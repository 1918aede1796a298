#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bench/reference/scene_surface.h"
#include "runtime/rays/cumulative_choice.h"

namespace rebounce::reference {

/// A point on an emitting triangle.
struct EmitterPoint {
  std::uint32_t triangle = kNone;
  glm::dvec2 barycentric{0, 0};  ///< weights of the second and third vertex
  glm::dvec3 position{0, 0, 0};
  glm::dvec3 front_normal{0, 0, 0};  ///< unit
};

/// Chooses points on the emitting triangles: a triangle in proportion to its power, then a point
/// uniformly by area.
class EmitterSampler {
 public:
  /// `surface` must outlive it.
  explicit EmitterSampler(const SceneSurface& surface);

  bool empty() const { return emitters_.empty(); }

  /// `choice` in [0, 1) and `square` in [0, 1)² select the point. Not for an empty sampler.
  EmitterPoint sample(double choice, const glm::dvec2& square) const;

  /// The density in 1/m² with which sample() gives points of `triangle`; 0 for those it never does.
  double area_density(std::uint32_t triangle) const { return area_density_[triangle]; }

 private:
  const SceneSurface* surface_;
  std::vector<std::uint32_t> emitters_;
  CumulativeChoice choice_;           // beside emitters_
  std::vector<double> area_density_;  // [t]
};

}  // namespace rebounce::reference
