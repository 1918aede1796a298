#include "rebounce/precompute/reconstruction_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "rebounce/precompute/subdivision.h"
#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

constexpr double kCreaseCosine = 0.766;  // 40 degrees: rounder is meant to look smooth
constexpr float kMostlyCovered = 0.9F;   // what little is left of such a patch is too noisy to show

// Height of the rays that tell whether a triangle lies in the open, as a part of its size; and how
// far their feet are drawn in from its corners, so that they keep clear of the walls beside it.
constexpr double kProbeHeight = 0.25, kProbeInset = 0.2;

/// How a triangle lies among the surfaces close above it.
enum class Exposure : std::uint8_t { kOpen, kMixed, kCovered };

/// One corner of a display triangle, as seen from the place where it is.
struct Corner {
  std::uint32_t triangle;
  std::uint32_t patch;
  glm::vec3 normal;
  float angle;
};

std::array<glm::dvec3, 3> corners_of(const DisplayMesh& mesh, const Uint3& t) {
  return {to_dvec3(mesh.position[t[0]]), to_dvec3(mesh.position[t[1]]),
          to_dvec3(mesh.position[t[2]])};
}

double corner_angle(const std::array<glm::dvec3, 3>& p, int corner) {
  const glm::dvec3 u = p[(corner + 1) % 3] - p[corner], v = p[(corner + 2) % 3] - p[corner];
  return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
}

Ray segment_ray(const Float3& from, const Float3& to) {
  Ray ray{};
  ray.origin = from;
  ray.t_near = 0;
  ray.direction = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  ray.t_far = 1;
  return ray;
}

/// Looks straight up from four points of the triangle, and between their upper ends.
Exposure find_exposure(const std::array<glm::dvec3, 3>& p, const RayTracer& tracer) {
  const glm::dvec3 cross = glm::cross(p[1] - p[0], p[2] - p[0]);
  const glm::dvec3 normal = glm::normalize(cross);
  const double height = kProbeHeight * std::sqrt(0.5 * glm::length(cross));
  const glm::dvec3 middle = (p[0] + p[1] + p[2]) / 3.0;
  std::array<Float3, 4> foot, top;
  for (int k = 0; k < 4; ++k) {
    const glm::dvec3 at = k < 3 ? glm::mix(p[k], middle, kProbeInset) : middle;
    foot[k] = tracer.offset_point(to_float3(at), to_float3(normal));
    top[k] = to_float3(at + height * normal);
  }
  std::array<Ray, 7> rays;
  for (int k = 0; k < 4; ++k) rays[k] = segment_ray(foot[k], top[k]);
  for (int k = 0; k < 3; ++k) rays[4 + k] = segment_ray(top[k], top[3]);
  tracer.occluded(rays);
  const auto covered = std::count_if(rays.begin(), rays.begin() + 4, is_occluded);
  const bool divided = std::any_of(rays.begin() + 4, rays.end(), is_occluded);
  if (covered == 4) return Exposure::kCovered;
  return covered > 0 || divided ? Exposure::kMixed : Exposure::kOpen;
}

class ReconstructionWeights {
 public:
  ReconstructionWeights(std::span<const std::uint32_t> shown_patch, std::span<const float> absorbed,
                        const RayTracer& tracer, DisplayMesh& mesh)
      : absorbed_(absorbed),
        mesh_(mesh),
        welded_(weld_positions(mesh.position)),
        corners_at_(welded_.count),
        exposure_(mesh.triangle.size()),
        vertex_normal_(mesh.position.size(), glm::dvec3(0)) {
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      add_corners(t, shown_patch[t]);
    }
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t t = 0; t < exposure_.size(); ++t) {
      exposure_[t] = find_exposure(corners_of(mesh_, mesh_.triangle[t]), tracer);
    }
  }

  void compute() {
    mesh_.weight_begin.assign(1, 0);
    mesh_.weight_patch.clear();
    mesh_.weight.clear();
    std::vector<Corner> corners;
    for (std::uint32_t v = 0; v < mesh_.position.size(); ++v) {
      choose_corners(v, corners);
      append_weights(corners);
      mesh_.weight_begin.push_back(static_cast<std::uint32_t>(mesh_.weight.size()));
    }
  }

 private:
  void add_corners(std::uint32_t t, std::uint32_t patch) {
    const std::array<glm::dvec3, 3> p = corners_of(mesh_, mesh_.triangle[t]);
    const glm::dvec3 area = glm::cross(p[1] - p[0], p[2] - p[0]);
    const glm::vec3 normal(glm::normalize(area));
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh_.triangle[t][k];
      vertex_normal_[v] += area;
      if (patch == kNone || absorbed_[patch] > kMostlyCovered) continue;
      const auto angle = static_cast<float>(corner_angle(p, k));
      corners_at_[welded_.id[v]].push_back({t, patch, normal, angle});
    }
  }

  bool is_open(const Corner& corner) const {
    return exposure_[corner.triangle] == Exposure::kOpen;
  }

  /// Adds the corners at a position whose triangles face the way `normal` does.
  void collect(std::uint32_t position, const glm::dvec3& normal,
               std::vector<Corner>& corners) const {
    for (const Corner& corner : corners_at_[position]) {
      if (glm::dot(normal, glm::dvec3(corner.normal)) >= kCreaseCosine) corners.push_back(corner);
    }
  }

  void choose_corners(std::uint32_t v, std::vector<Corner>& corners) const {
    const glm::dvec3 normal = vertex_normal_[v] / std::max(glm::length(vertex_normal_[v]), 1e-300);
    corners.clear();
    collect(welded_.id[v], normal, corners);
    const auto open = [&](const Corner& c) { return is_open(c); };
    const auto closed = [&](const Corner& c) { return !is_open(c); };
    if (std::ranges::all_of(corners, open)) return;
    if (std::ranges::any_of(corners, open)) {
      std::erase_if(corners, closed);
      return;
    }
    const bool mixed = std::ranges::any_of(
        corners, [&](const Corner& c) { return exposure_[c.triangle] == Exposure::kMixed; });
    if (!mixed) return;  // under a cover all around: what is there is right
    std::vector<Corner> ring;
    for (const Corner& corner : corners) {
      for (const std::uint32_t neighbour : mesh_.triangle[corner.triangle]) {
        if (welded_.id[neighbour] != welded_.id[v]) collect(welded_.id[neighbour], normal, ring);
      }
    }
    std::erase_if(ring, closed);
    if (!ring.empty()) corners = ring;
  }

  void append_weights(const std::vector<Corner>& corners) {
    std::map<std::uint32_t, double> weight_of;
    double sum = 0;
    for (const Corner& corner : corners) {
      weight_of[corner.patch] += corner.angle;
      sum += corner.angle * (1.0 - absorbed_[corner.patch]);
    }
    for (const auto& [patch, weight] : weight_of) {
      mesh_.weight_patch.push_back(patch);
      mesh_.weight.push_back(static_cast<float>(weight / sum));
    }
  }

  std::span<const float> absorbed_;
  DisplayMesh& mesh_;
  WeldedPositions welded_;
  std::vector<std::vector<Corner>> corners_at_;  ///< by position
  std::vector<Exposure> exposure_;               ///< by display triangle
  std::vector<glm::dvec3> vertex_normal_;        ///< area-weighted
};

}  // namespace

void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, const RayTracer& tracer,
                                    DisplayMesh& mesh) {
  ReconstructionWeights(shown_patch, absorbed, tracer, mesh).compute();
}

}  // namespace rebounce
