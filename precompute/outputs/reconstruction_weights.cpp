#include "precompute/outputs/reconstruction_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "precompute/base/parallel_loop.h"
#include "precompute/outputs/local_max_entropy.h"
#include "precompute/outputs/mean_preservation.h"
#include "precompute/outputs/neighbour_search.h"
#include "precompute/patches/covers.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/sampling.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// Height of the rays that tell whether a triangle is open, as a fraction of its size; and the
// distance of their origins from its corners, so that they avoid the walls beside it.
constexpr double kProbeHeight = 0.25, kProbeInset = 0.2;

// Slivers beside a contact are tested as if they had this fraction of the size of a mean patch, so
// that the test notices what hangs close above them.
constexpr double kLeastProbeSize = 0.5;

// A patch is open if less than this fraction of its area is covered, and covered if less than this
// is open.
constexpr double kLittle = 0.1;

// The distance within which a vertex looks for patches, in its own mean patch sizes; the larger one
// applies where all near patches are mixed (lab/026).
constexpr float kReach = 1, kFartherReach = 2;

// How strongly the mean place of the patches is drawn to the vertex: a compromise between edges and
// the number of patches that are averaged (lab/026).
constexpr double kRidge = 0.1;

// Patches below this fraction of the value of a vertex are left out.
constexpr float kNegligible = 1e-3F;

// Vertices between two reports of progress.
constexpr std::size_t kPointBatch = 1 << 14;

// The largest sum of negative weights of a vertex that the preservation of means may add.
constexpr double kMostNegative = 0.5;

/// How a triangle lies relative to surfaces close above it.
enum class Exposure : std::uint8_t { kOpen, kMixed, kCovered };

Ray segment_ray(const Float3& from, const Float3& to) {
  Ray ray{};
  ray.origin = from;
  ray.t_near = 0;
  ray.direction = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  ray.t_far = 1;
  return ray;
}

/// Traces rays straight up from four points of the triangle, and between their upper ends. Their
/// length suits a triangle of at least `least_size` metres.
Exposure find_exposure(const TriangleCorners& p, double least_size, const RayTracer& tracer) {
  const glm::dvec3 cross = glm::cross(p[1] - p[0], p[2] - p[0]);
  const glm::dvec3 normal = glm::normalize(cross);
  const double height = kProbeHeight * std::max(std::sqrt(0.5 * glm::length(cross)), least_size);
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

/// The patches that the triangles of each vertex show.
class VertexPatches {
 public:
  VertexPatches(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch)
      : begin_(mesh.position.size() + 1, 0), end_(mesh.position.size()) {
    for (const Uint3& corner : mesh.triangle) {
      for (const std::uint32_t v : corner) ++begin_[v + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::copy(begin_.begin(), begin_.end() - 1, end_.begin());
    patch_.resize(begin_.back());
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      if (shown_patch[t] == kNone) continue;
      for (const std::uint32_t v : mesh.triangle[t]) add(v, shown_patch[t]);
    }
  }

  std::span<const std::uint32_t> operator[](std::size_t v) const {
    return {patch_.data() + begin_[v], patch_.data() + end_[v]};
  }

 private:
  void add(std::uint32_t v, std::uint32_t patch) {
    if (std::ranges::find((*this)[v], patch) == (*this)[v].end()) patch_[end_[v]++] = patch;
  }

  std::vector<std::uint32_t> begin_, end_;  ///< ranges in patch_, by vertex
  std::vector<std::uint32_t> patch_;        ///< with room for all corners
};

class ReconstructionWeights {
 public:
  ReconstructionWeights(std::span<const std::uint32_t> shown_patch, std::span<const float> absorbed,
                        const RayTracer& tracer, DisplayMesh& mesh)
      : shown_patch_(shown_patch),
        absorbed_(absorbed),
        tracer_(tracer),
        mesh_(mesh),
        triangles_(mesh.triangle_patch, absorbed.size()),
        own_patches_(mesh, shown_patch) {
    measure_patches();
    make_receivers();
  }

  void compute(const Progress& progress) {
    const std::size_t count = mesh_.position.size();
    shows_arriving_ = is_covered_;
    const NeighbourSearch search(mesh_, triangles_, area_, absorbed_, tracer_);
    std::vector<VertexWeights> weights(count);
    for (std::size_t begin = 0; begin < count; begin += kPointBatch) {
      report_progress(progress, static_cast<double>(begin) / static_cast<double>(count));
      compute_batch(search, begin, std::min(begin + kPointBatch, count), weights);
    }
    preserve_patch_means(mesh_, triangles_, good_patches(), {kMostNegative, kMostSites}, weights);
    write_weights(weights);
  }

 private:
  auto is(Exposure exposure) const {
    return [this, exposure](const ReconstructionSite& site) {
      return exposure_[site.patch] == exposure;
    };
  }

  /// Computes the weights of vertices [begin, end) before the preservation of means.
  void compute_batch(const NeighbourSearch& search, std::size_t begin, std::size_t end,
                     std::vector<VertexWeights>& weights) {
    parallel_loop(
        end - begin, 64, [&] { return NeighbourSearch::Scratch(search); },
        [&](std::size_t k, NeighbourSearch::Scratch& scratch) {
          const std::size_t v = begin + k;
          if (!receivers_[v].is_shown) return;
          std::vector<ReconstructionSite> sites = find_sites(search, v, scratch);
          centre_weights(receivers_[v], sites);
          if (std::ranges::all_of(sites, is(Exposure::kCovered)) || are_mostly_covered(sites)) {
            shows_arriving_[v] = 1;
          }
          weights[v] = shows_arriving_[v] != 0 ? plain_weights(sites) : open_weights(sites);
        });
  }

  /// The square root of the mean area of the patches, metres.
  double mean_patch_size() const {
    double area = 0;
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t) {
      if (mesh_.triangle_patch[t] == kNone) continue;
      area += area_of(corners_of(mesh_, t));
    }
    return std::sqrt(area / static_cast<double>(std::max<std::size_t>(absorbed_.size(), 1)));
  }

  /// Classifies the patches. A patch is mixed if neither its open nor its covered part is small.
  void measure_patches() {
    const std::size_t n = triangles_.patch_count();
    area_.resize(n);
    centroid_.resize(n);
    exposure_.resize(n);
    const double least_size = kLeastProbeSize * mean_patch_size();
#pragma omp parallel for schedule(dynamic, 16)
    for (std::size_t i = 0; i < n; ++i) {
      std::array<double, 3> area{};
      glm::dvec3 moment(0);
      for (const std::uint32_t t : triangles_[i]) {
        const TriangleCorners p = corners_of(mesh_, t);
        const double size = area_of(p);
        area[static_cast<std::size_t>(find_exposure(p, least_size, tracer_))] += size;
        moment += size / 3 * (p[0] + p[1] + p[2]);
      }
      const double whole = area[0] + area[1] + area[2];
      const double covered = area[2] + 0.5 * area[1];
      area_[i] = static_cast<float>(whole);
      centroid_[i] = glm::vec3(moment / whole);
      exposure_[i] = covered < kLittle * whole         ? Exposure::kOpen
                     : covered > (1 - kLittle) * whole ? Exposure::kCovered
                                                       : Exposure::kMixed;
    }
  }

  /// For each triangle, whether it shows a patch and is covered.
  std::vector<std::uint8_t> find_covered() const {
    const double height = kCloseCover * mean_patch_size();
    std::vector<std::uint8_t> covered(mesh_.triangle.size(), 0);
#pragma omp parallel for schedule(dynamic, 256)
    for (std::uint32_t t = 0; t < covered.size(); ++t) {
      if (shown_patch_[t] == kNone) continue;
      covered[t] = is_covered(corners_of(mesh_, t), tracer_, height) ? 1 : 0;
    }
    return covered;
  }

  void make_receivers() {
    receivers_.resize(mesh_.position.size());
    std::vector<glm::dvec3> normal(receivers_.size(), glm::dvec3(0));
    std::vector<double> largest(receivers_.size(), 0.0);
    std::vector<float> size_sum(receivers_.size(), 0.0F), count(receivers_.size(), 0.0F);
    is_covered_.assign(receivers_.size(), 1);
    const std::vector<std::uint8_t> covered = find_covered();
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t) {
      const std::uint32_t patch = shown_patch_[t];
      if (patch == kNone) continue;
      const TriangleCorners p = corners_of(mesh_, t);
      const glm::dvec3 cross = glm::cross(p[1] - p[0], p[2] - p[0]);
      const double area = glm::length(cross);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh_.triangle[t][k];
        normal[v] += cross;
        if (area > largest[v]) {
          largest[v] = area;
          receivers_[v].inset = glm::vec3(glm::mix(p[k], (p[0] + p[1] + p[2]) / 3.0, kProbeInset));
        }
        receivers_[v].is_shown = true;
        if (covered[t] == 0) is_covered_[v] = 0;
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
  }

  /// The patches of a vertex. An open vertex uses open patches, if necessary from farther away;
  /// otherwise mixed ones, whose edge it lies on; otherwise its own. A covered vertex uses covered
  /// patches, otherwise mixed ones, otherwise its own.
  std::vector<ReconstructionSite> find_sites(const NeighbourSearch& search, std::size_t v,
                                             NeighbourSearch::Scratch& scratch) const {
    const auto within = [&](float reach) {
      return search.find(receivers_[v], own_patches_[v], reach, scratch);
    };
    std::vector<ReconstructionSite> near = within(receivers_[v].reach);
    if (is_covered_[v] != 0) {
      for (const Exposure e : {Exposure::kCovered, Exposure::kMixed}) {
        if (std::ranges::any_of(near, is(e))) return only(near, is(e));
      }
      return own_sites(v);
    }
    if (std::ranges::any_of(near, is(Exposure::kOpen))) return only(near, is(Exposure::kOpen));
    if (std::ranges::any_of(near, is(Exposure::kMixed))) {
      std::vector<ReconstructionSite> farther =
          only(within(kFartherReach * receivers_[v].reach), is(Exposure::kOpen));
      if (!farther.empty()) return farther;
    }
    return near.empty() ? own_sites(v) : near;
  }

  /// The patches of the triangles of a vertex, with equal weights.
  std::vector<ReconstructionSite> own_sites(std::size_t v) const {
    std::vector<ReconstructionSite> sites;
    for (const std::uint32_t patch : own_patches_[v]) {
      sites.push_back({patch, 1.0F, 0, receivers_[v].position, receivers_[v].normal});
    }
    return sites;
  }

  template <typename Wanted>
  static std::vector<ReconstructionSite> only(std::vector<ReconstructionSite> sites,
                                              const Wanted& wanted) {
    std::erase_if(sites, [&](const ReconstructionSite& g) { return !wanted(g); });
    return sites;
  }

  /// Shifts the weights so that the centroids of the patches balance about the vertex.
  void centre_weights(const Receiver& receiver, std::vector<ReconstructionSite>& sites) const {
    if (sites.empty() || receiver.reach <= 0) return;
    const glm::dmat3 frame = frame_around(receiver.normal);
    std::vector<double> prior;
    std::vector<glm::dvec2> place;
    for (const ReconstructionSite& site : sites) {
      const glm::dvec3 offset(centroid_[site.patch] - receiver.position);
      prior.push_back(site.weight);
      place.push_back(glm::dvec2(offset * frame) / static_cast<double>(receiver.reach));
    }
    const std::vector<double> weight = max_entropy_weights(prior, place, kRidge);
    for (std::size_t k = 0; k < sites.size(); ++k) sites[k].weight = static_cast<float>(weight[k]);
    std::erase_if(sites, [](const ReconstructionSite& site) { return site.weight < kNegligible; });
  }

  /// Patches in the open, whose means can be trusted.
  std::vector<std::uint8_t> good_patches() const {
    std::vector<std::uint8_t> good(exposure_.size());
    for (std::size_t i = 0; i < good.size(); ++i) {
      const bool is_good = exposure_[i] == Exposure::kOpen && absorbed_[i] <= kMostlyCovered;
      good[i] = is_good ? 1 : 0;
    }
    return good;
  }

  /// The sum of the weights times the fractions that are not absorbed.
  double open_sum(const std::vector<ReconstructionSite>& sites) const {
    double sum = 0;
    for (const ReconstructionSite& site : sites) sum += site.weight * (1.0 - absorbed_[site.patch]);
    return sum;
  }

  /// Whether nearly all of the light over the patches is absorbed. To show the rest as light in the
  /// open would multiply all of its errors.
  bool are_mostly_covered(const std::vector<ReconstructionSite>& sites) const {
    double whole = 0;
    for (const ReconstructionSite& site : sites) whole += site.weight;
    return open_sum(sites) < (1 - kMostlyCovered) * whole;
  }

  /// The weights of light in the open; a patch only shows the fraction that is not absorbed.
  VertexWeights open_weights(const std::vector<ReconstructionSite>& sites) const {
    const double sum = open_sum(sites);
    VertexWeights weight;
    if (sum <= 0) return weight;
    for (const ReconstructionSite& site : sites) {
      weight.push_back({site.patch, site.weight * (1.0 - absorbed_[site.patch]) / sum});
    }
    return weight;
  }

  /// The weights of light under a cover.
  static VertexWeights plain_weights(const std::vector<ReconstructionSite>& sites) {
    double sum = 0;
    for (const ReconstructionSite& site : sites) sum += site.weight;
    VertexWeights weight;
    for (const ReconstructionSite& site : sites) weight.push_back({site.patch, site.weight / sum});
    return weight;
  }

  void write_weights(const std::vector<VertexWeights>& weights) {
    mesh_.weight_begin.assign(1, 0);
    mesh_.weight_patch.clear();
    mesh_.weight.clear();
    for (std::size_t v = 0; v < weights.size(); ++v) {
      for (const auto& [patch, weight] : weights[v]) {
        const double open = shows_arriving_[v] != 0 ? 1.0 : 1.0 - absorbed_[patch];
        if (open <= 0) continue;
        mesh_.weight_patch.push_back(patch);
        mesh_.weight.push_back(static_cast<float>(weight / open));
      }
      mesh_.weight_begin.push_back(static_cast<std::uint32_t>(mesh_.weight.size()));
    }
  }

  std::span<const std::uint32_t> shown_patch_;
  std::span<const float> absorbed_;
  const RayTracer& tracer_;
  DisplayMesh& mesh_;
  const PatchTriangles triangles_;
  const VertexPatches own_patches_;
  std::vector<float> area_;               ///< [n] m²
  std::vector<glm::vec3> centroid_;       ///< [n]
  std::vector<Exposure> exposure_;        ///< [n]
  std::vector<Receiver> receivers_;       ///< [v]
  std::vector<std::uint8_t> is_covered_;  ///< [v] all its triangles that show a patch are covered
  /// [v] The vertex is covered or all its patches are: what they receive is shown as it is.
  std::vector<std::uint8_t> shows_arriving_;
};

}  // namespace

void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, const RayTracer& tracer,
                                    DisplayMesh& mesh, const Progress& progress) {
  ReconstructionWeights(shown_patch, absorbed, tracer, mesh).compute(progress);
}

}  // namespace rebounce
