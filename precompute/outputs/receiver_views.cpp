#include "precompute/outputs/receiver_views.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numeric>

#include "precompute/sampling/hemisphere_rays.h"
#include "runtime/rays/cumulative_choice.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// All places have the same sequences: where neighbours see the same, their rows are the same.
constexpr glm::dvec2 kPlaceShift{0.25, 0.75}, kDirectionShift{0.5, 0.5};

// How much of the dual function is in the weights of a vertex; the rest is the hat function.
constexpr double kDualPart = 0.75;  // lab/109

// The weight of places that are not seen, beside that of those that are: it decides where none is.
constexpr double kUnseen = 1.0 / 64;

// A point of which a larger part of the rays meet backs of surfaces lies inside of a body, as a
// probe does (light_probes.h, lab/127).
constexpr double kMostBacks = 0.25;

/// Points on the triangles around a vertex, evenly by area.
class RingPoints {
 public:
  RingPoints(const DisplayMesh& mesh, std::uint32_t vertex,
             std::span<const std::uint32_t> triangles)
      : mesh_(mesh), vertex_(vertex), triangles_(triangles) {
    for (const std::uint32_t t : triangles) choice_.add(area_of(corners_of(mesh, t)));
  }

  bool empty() const { return !(choice_.total() > 0); }

  /// Returns a point, and writes the height of the vertex's hat function there.
  PatchPoint at(const glm::dvec2& square, double& height) const {
    const auto [index, rest] = choice_.choose(square.x);
    const std::uint32_t t = triangles_[index];
    const TriangleCorners p = corners_of(mesh_, t);
    std::size_t own = 0;
    while (mesh_.triangle[t][own] != vertex_) ++own;
    const double away = std::sqrt(rest);
    height = 1 - away;
    const glm::dvec3 far = glm::mix(p[(own + 1) % 3], p[(own + 2) % 3], square.y);
    return {to_float3(glm::mix(p[own], far, away)), to_float3(front_normal(p))};
  }

 private:
  const DisplayMesh& mesh_;
  std::uint32_t vertex_;
  std::span<const std::uint32_t> triangles_;
  CumulativeChoice choice_;
};

}  // namespace

ReceiverViewer::ReceiverViewer(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                               std::size_t patch_count, const RayTracer& tracer, int ray_count)
    : mesh_(mesh),
      shown_patch_(shown_patch),
      tracer_(tracer),
      point_(static_cast<std::size_t>(ray_count)),
      height_(point_.size()),
      ray_(point_.size()),
      hit_(point_.size()),
      sum_(patch_count, 0.0) {}

void ReceiverViewer::trace() {
  make_hemisphere_rays(point_, tracer_, kDirectionShift, ray_);
  intersect();
}

void ReceiverViewer::intersect() {
  tracer_.intersect(ray_, hit_);
  for (std::size_t k = 0; k < ray_.size(); ++k) {
    prefer_lit_side(mesh_, tracer_, ray_[k], hit_[k], scratch_);
  }
}

void ReceiverViewer::add(std::uint32_t patch, double part) {
  if (patch == kNone) return;
  if (sum_[patch] == 0) touched_.push_back(patch);
  sum_[patch] += part;
}

void ReceiverViewer::take(ViewRow& row) {
  std::ranges::sort(touched_);
  row.clear();
  for (const std::uint32_t patch : touched_) {
    if (sum_[patch] != 0) row.push_back({patch, static_cast<float>(sum_[patch])});
    sum_[patch] = 0;
  }
  touched_.clear();
}

void ReceiverViewer::look_from_patch(std::span<const std::uint32_t> triangles, ViewRow& row) {
  spread_points(mesh_, triangles, kPlaceShift, point_);
  trace();
  for (const Hit& hit : hit_) {
    add(patch_at(mesh_, shown_patch_, hit), 1 / static_cast<double>(hit_.size()));
  }
  take(row);
}

double ReceiverViewer::keep_seen(double sight) {
  const std::size_t count = point_.size();
  NormalFrame frame;
  for (std::size_t k = 0; k < count; ++k) {
    // Independent of the rays that bring light: at random, and not by their sequence.
    const glm::vec3 direction = to_cosine_direction(unit_square(mix_bits(k)));
    ray_[k] = make_free_ray(point_[k], frame.turn(point_[k].normal, direction), tracer_);
    ray_[k].t_far = static_cast<float>(sight);
  }
  tracer_.intersect(ray_, hit_);
  const auto seen_count = static_cast<double>(std::ranges::count(hit_, kNone, &Hit::triangle));
  const double step = (seen_count + kUnseen * (static_cast<double>(count) - seen_count)) /
                      static_cast<double>(count);
  const std::vector<PatchPoint> place = point_;
  const std::vector<double> height = height_;
  double reached = 0;  // by the places before `next`
  std::size_t next = 0;
  for (std::size_t k = 0; k < count; ++k) {
    while (next < count && reached <= (static_cast<double>(k) + 0.5) * step) {
      reached += hit_[next++].triangle == kNone ? 1 : kUnseen;
    }
    point_[k] = place[next - 1];
    height_[k] = height[next - 1];
  }
  return seen_count / static_cast<double>(count);
}

// The dual functions of the hat functions h_v over the triangles around v are 4 h_v - 1: their
// product with h_w has the mean 0 over each triangle unless w is v. A value that is the mean of the
// light with the weight 3 (4 h_v - 1) is therefore exact for light that is linear over triangles
// (B. Wohlmuth, "A mortar finite element method using dual spaces for the Lagrange multiplier",
// 2000). The mean with the hat function itself, 3 h_v, flattens the light and is less noisy.
void ReceiverViewer::look_from_vertex(std::uint32_t vertex,
                                      std::span<const std::uint32_t> triangles, double sight,
                                      ViewRow& row) {
  row.clear();
  const RingPoints ring(mesh_, vertex, triangles);
  if (ring.empty()) return;
  const PointSequence places = r2_sequence(kPlaceShift);
  for (std::uint32_t k = 0; k < point_.size(); ++k) point_[k] = ring.at(places[k], height_[k]);
  const double seen = keep_seen(sight);
  trace();
  // Where little is seen, to go on from there to the vertex would be noisy.
  const double dual_part = kDualPart * seen;
  const double heights = std::accumulate(height_.begin(), height_.end(), 0.0);
  // What the dual function adds has the sum 0 also where a part is left out.
  const double mean = 3 - static_cast<double>(height_.size()) / heights;
  for (std::size_t k = 0; k < height_.size(); ++k) {
    const double dual = 3 * height_[k] - 1 - mean * height_[k];
    add(patch_at(mesh_, shown_patch_, hit_[k]), (height_[k] + dual_part * dual) / heights);
  }
  take(row);
}

void ReceiverViewer::look_from_point(const PatchPoint& point, const Float3& shading_normal,
                                     ViewRow& row) {
  row.clear();
  const PointSequence directions = direction_sequence(kDirectionShift);
  const glm::vec3 front = to_glm(point.normal);
  NormalFrame frame;
  for (std::uint32_t k = 0; k < ray_.size(); ++k) {
    glm::vec3 direction = frame.turn(shading_normal, to_cosine_direction(directions[k]));
    const float away = glm::dot(direction, front);
    if (away < 0) direction -= 2 * away * front;
    ray_[k] = make_free_ray(point, direction, tracer_);
  }
  intersect();
  const auto backs =
      std::ranges::count_if(hit_, [this](const Hit& hit) { return meets_back(mesh_, hit); });
  if (static_cast<double>(backs) > kMostBacks * static_cast<double>(hit_.size())) return;
  for (const Hit& hit : hit_) {
    add(patch_at(mesh_, shown_patch_, hit), 1 / static_cast<double>(hit_.size()));
  }
  take(row);
}

}  // namespace rebounce
