#include "rebounce/precompute/reconstruction_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "element_neighbours.h"
#include "point_finder.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/patch_points.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {
namespace {

constexpr float kCreaseCosine = 0.766F;  // 40 degrees: rounder is meant to look smooth
constexpr float kMostlyCovered = 0.9F;   // what little is left of such a patch is too noisy to show

// Height of the rays that tell whether a triangle lies in the open, as a part of its size; and how
// far their feet are drawn in from its corners, so that they keep clear of the walls beside it.
constexpr double kProbeHeight = 0.25, kProbeInset = 0.2;

// A patch with less than this part of its area covered is open, and the other way round.
constexpr double kLittle = 0.1;

// Points of a patch that stand for it.
constexpr std::size_t kSampleCount = 16;

// How far a vertex looks for patches, in mean sizes of its own: chosen with bench_truth
// (notes/patches.md). Farther where all near ones are mixed; how far off its plane, in parts of
// that.
constexpr float kReach = 1.1F, kFartherReach = 2, kPlaneReach = 0.25F;

// Patches that give to a vertex, at most.
constexpr std::size_t kMostGivers = 16;

/// How a triangle lies among the surfaces close above it.
enum class Exposure : std::uint8_t { kOpen, kMixed, kCovered };

std::array<glm::dvec3, 3> corners_of(const DisplayMesh& mesh, const Uint3& t) {
  return {to_dvec3(mesh.position[t[0]]), to_dvec3(mesh.position[t[1]]),
          to_dvec3(mesh.position[t[2]])};
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

/// A place of a patch that gives its value to vertices around it.
struct Sample {
  glm::vec3 position{0}, normal{0};
  std::uint32_t patch = kNone;
  float share = 0;  ///< of area
};

/// What a patch gives to one vertex.
struct Giver {
  std::uint32_t patch;
  float weight;
  float distance_squared;  ///< of its nearest sample
  glm::vec3 position;      ///< of that sample
  glm::vec3 normal;
};

/// A display vertex with what its triangles say.
struct Receiver {
  glm::vec3 position{0};
  glm::vec3 normal{0};    ///< unit, area-weighted over its triangles
  glm::vec3 inset{0};     ///< a point of its largest triangle, clear of the surfaces at its edges
  float reach = 0;        ///< metres
  bool is_shown = false;  ///< some triangle of it shows a patch
};

class ReconstructionWeights {
 public:
  ReconstructionWeights(std::span<const std::uint32_t> shown_patch, std::span<const float> absorbed,
                        const RayTracer& tracer, DisplayMesh& mesh)
      : shown_patch_(shown_patch),
        absorbed_(absorbed),
        tracer_(tracer),
        mesh_(mesh),
        triangles_(mesh.triangle_patch, absorbed.size()) {
    find_exposures();
    make_samples();
    make_receivers();
  }

  void compute() {
    const std::size_t count = mesh_.position.size();
    std::vector<std::vector<Giver>> givers(count);
#pragma omp parallel for schedule(dynamic, 256)
    for (std::size_t v = 0; v < count; ++v) {
      if (receivers_[v].is_shown) givers[v] = find_givers(static_cast<std::uint32_t>(v));
    }
    mesh_.weight_begin.assign(1, 0);
    mesh_.weight_patch.clear();
    mesh_.weight.clear();
    for (const std::vector<Giver>& of_vertex : givers) {
      append_weights(of_vertex);
      mesh_.weight_begin.push_back(static_cast<std::uint32_t>(mesh_.weight.size()));
    }
  }

 private:
  /// A patch is mixed if the open and the covered part of its area are both worth the name.
  void find_exposures() {
    const std::size_t n = triangles_.patch_count();
    area_.resize(n);
    exposure_.resize(n);
#pragma omp parallel for schedule(dynamic, 16)
    for (std::size_t i = 0; i < n; ++i) {
      std::array<double, 3> area{};
      for (const std::uint32_t t : triangles_[i]) {
        const std::array<glm::dvec3, 3> p = corners_of(mesh_, mesh_.triangle[t]);
        const double size = 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
        area[static_cast<std::size_t>(find_exposure(p, tracer_))] += size;
      }
      const double whole = area[0] + area[1] + area[2];
      const double covered = area[2] + 0.5 * area[1];
      area_[i] = static_cast<float>(whole);
      exposure_[i] = covered < kLittle * whole         ? Exposure::kOpen
                     : covered > (1 - kLittle) * whole ? Exposure::kCovered
                                                       : Exposure::kMixed;
    }
  }

  void make_samples() {
    const std::size_t n = triangles_.patch_count();
    samples_.resize(n * kSampleCount);
    positions_.resize(n * kSampleCount);
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t i = 0; i < n; ++i) {
      std::array<PatchPoint, kSampleCount> points;
      spread_points(mesh_, triangles_[i], unit_square(mix_bits(i)), points);
      for (std::size_t k = 0; k < kSampleCount; ++k) {
        const std::size_t place = i * kSampleCount + k;
        samples_[place] = {to_glm(points[k].position), to_glm(points[k].normal),
                           static_cast<std::uint32_t>(i), area_[i] / kSampleCount};
        positions_[place] = points[k].position;
      }
    }
    finder_.emplace(positions_);
  }

  void make_receivers() {
    receivers_.resize(mesh_.position.size());
    std::vector<glm::dvec3> normal(receivers_.size(), glm::dvec3(0));
    std::vector<double> largest(receivers_.size(), 0.0);
    std::vector<float> size_sum(receivers_.size(), 0.0F), count(receivers_.size(), 0.0F);
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t) {
      const std::array<glm::dvec3, 3> p = corners_of(mesh_, mesh_.triangle[t]);
      const glm::dvec3 cross = glm::cross(p[1] - p[0], p[2] - p[0]);
      const double area = glm::length(cross);
      const std::uint32_t patch = shown_patch_[t];
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh_.triangle[t][k];
        normal[v] += cross;
        if (area > largest[v]) {
          largest[v] = area;
          receivers_[v].inset = glm::vec3(glm::mix(p[k], (p[0] + p[1] + p[2]) / 3.0, kProbeInset));
        }
        if (patch == kNone) continue;
        receivers_[v].is_shown = true;
        size_sum[v] += std::sqrt(area_[patch]);
        count[v] += 1;
      }
    }
    for (std::size_t v = 0; v < receivers_.size(); ++v) {
      receivers_[v].position = to_glm(mesh_.position[v]);
      const double length = glm::length(normal[v]);
      if (length > 0) receivers_[v].normal = glm::vec3(normal[v] / length);
      receivers_[v].reach = kReach * size_sum[v] / std::max(count[v], 1.0F);
    }
    add_own_patches();
  }

  /// For each vertex the patches that its own triangles show.
  void add_own_patches() {
    own_patches_.resize(receivers_.size());
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t) {
      if (shown_patch_[t] == kNone) continue;
      for (const std::uint32_t v : mesh_.triangle[t]) {
        std::vector<std::uint32_t>& own = own_patches_[v];
        if (std::ranges::find(own, shown_patch_[t]) == own.end()) own.push_back(shown_patch_[t]);
      }
    }
  }

  bool is_own(std::uint32_t v, std::uint32_t patch) const {
    return std::ranges::find(own_patches_[v], patch) != own_patches_[v].end();
  }

  /// Patches in the open, if need be from farther away; else those that are mixed, on whose rim the
  /// vertex lies; else its own.
  std::vector<Giver> find_givers(std::uint32_t v) const {
    std::vector<Giver> near = givers_within(v, receivers_[v].reach);
    const auto is = [&](Exposure e) {
      return [this, e](const Giver& g) { return exposure_[g.patch] == e; };
    };
    if (std::ranges::any_of(near, is(Exposure::kOpen))) return only(near, is(Exposure::kOpen));
    if (std::ranges::any_of(near, is(Exposure::kMixed))) {
      const std::vector<Giver> farther =
          only(givers_within(v, kFartherReach * receivers_[v].reach), is(Exposure::kOpen));
      if (!farther.empty()) return farther;
    }
    if (!near.empty()) return near;
    for (const std::uint32_t patch : own_patches_[v]) {
      near.push_back({patch, 1.0F, 0, receivers_[v].position, receivers_[v].normal});
    }
    return near;
  }

  template <typename Wanted>
  static std::vector<Giver> only(std::vector<Giver> givers, const Wanted& wanted) {
    std::erase_if(givers, [&](const Giver& g) { return !wanted(g); });
    return givers;
  }

  /// The patches with samples around a vertex that face as it does, about in its plane and in
  /// sight, the heaviest kMostGivers of them.
  std::vector<Giver> givers_within(std::uint32_t v, float reach) const {
    const Receiver& receiver = receivers_[v];
    std::map<std::uint32_t, Giver> giver_of;
    for (const auto& [index, distance_squared] : finder_->within(mesh_.position[v], reach)) {
      const Sample& sample = samples_[index];
      if (absorbed_[sample.patch] > kMostlyCovered) continue;
      if (glm::dot(sample.normal, receiver.normal) < kCreaseCosine) continue;
      const float height = glm::dot(sample.position - receiver.position, receiver.normal);
      if (std::abs(height) > kPlaneReach * reach) continue;
      const float fall = 1 - distance_squared / (reach * reach);
      Giver& giver =
          giver_of.try_emplace(sample.patch, Giver{sample.patch, 0, reach * reach, {}, {}})
              .first->second;
      giver.weight += sample.share * fall * fall;
      if (distance_squared > giver.distance_squared) continue;
      giver.distance_squared = distance_squared;
      giver.position = sample.position;
      giver.normal = sample.normal;
    }
    std::vector<Giver> givers;
    for (const auto& [patch, giver] : giver_of) {
      if (is_own(v, patch) || in_sight(receiver, giver)) givers.push_back(giver);
    }
    if (givers.size() > kMostGivers) {
      std::ranges::stable_sort(givers, std::greater<>(), &Giver::weight);
      givers.resize(kMostGivers);
      std::ranges::sort(givers, {}, &Giver::patch);
    }
    return givers;
  }

  bool in_sight(const Receiver& receiver, const Giver& giver) const {
    return find_between({to_float3(receiver.inset), to_float3(receiver.normal)},
                        {to_float3(giver.position), to_float3(giver.normal)}, tracer_) == kNone;
  }

  void append_weights(const std::vector<Giver>& givers) {
    double sum = 0;
    for (const Giver& giver : givers) sum += giver.weight * (1.0 - absorbed_[giver.patch]);
    if (sum <= 0) return;
    for (const Giver& giver : givers) {
      mesh_.weight_patch.push_back(giver.patch);
      mesh_.weight.push_back(static_cast<float>(giver.weight / sum));
    }
  }

  std::span<const std::uint32_t> shown_patch_;
  std::span<const float> absorbed_;
  const RayTracer& tracer_;
  DisplayMesh& mesh_;
  const PatchTriangles triangles_;
  std::vector<float> area_;         ///< [n] m²
  std::vector<Exposure> exposure_;  ///< [n]
  std::vector<Sample> samples_;     ///< [n][kSampleCount]
  std::vector<Float3> positions_;   ///< theirs
  std::optional<PointFinder> finder_;
  std::vector<Receiver> receivers_;                      ///< [v]
  std::vector<std::vector<std::uint32_t>> own_patches_;  ///< [v]
};

}  // namespace

void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, const RayTracer& tracer,
                                    DisplayMesh& mesh) {
  ReconstructionWeights(shown_patch, absorbed, tracer, mesh).compute();
}

}  // namespace rebounce
