#include "precompute/outputs/light_probes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "precompute/base/parallel_loop.h"
#include "precompute/outputs/emitter_points.h"
#include "precompute/outputs/harmonic_view.h"
#include "precompute/patches/hit_patch.h"
#include "rebounce/error.h"
#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr std::size_t kMostProbes = 65536;
constexpr std::size_t kProbeBatch = 64;  // probes between two reports of progress
constexpr double kLargestBackPart = 0.25;

// An emitter that this number of rays meets is known well. Others are sampled by points: this
// number of points each, and for all of them at most this number per ray (lab/068).
constexpr float kEnoughRays = 64;
constexpr int kMostPoints = 16, kPointsPerRay = 2;

// A ray reaches a point if it ends no farther from it than this fraction of the way.
constexpr float kAtPoint = 1e-3F;

using ProbeView = HarmonicView<kHarmonicCount>;  // the view of one probe

/// Direction k of `count` that are spread evenly over the sphere and turned about y by `turn`
/// turns: the spherical Fibonacci lattice (R. Swinbank and R. J. Purser, "Fibonacci grids: a novel
/// approach to global modelling", 2006).
Float3 fibonacci_direction(int k, int count, double turn) {
  const double y = 1 - (2 * k + 1.0) / count;
  const double r = std::sqrt(std::max(0.0, 1 - y * y));
  const double phi = 2 * std::numbers::pi * std::fmod(k / std::numbers::phi + turn, 1.0);
  return {static_cast<float>(r * std::cos(phi)), static_cast<float>(y),
          static_cast<float>(r * std::sin(phi))};
}

class ProbeViewer {
 public:
  ProbeViewer(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
              const RayTracer& tracer, std::span<const EmitterPoints> emitters, int ray_count)
      : mesh_(mesh),
        shown_patch_(shown_patch),
        emitters_(emitters),
        viewer_(mesh, shown_patch, tracer),
        rays_(static_cast<std::size_t>(ray_count)),
        hits_(rays_.size()) {}

  /// Empty for a probe that sees too many backs: it is inside something.
  std::optional<ProbeView> look_around(const Float3& position, std::uint64_t number) {
    const auto count = static_cast<int>(rays_.size());
    const double turn = unit_square(mix_bits(number)).x;
    for (int k = 0; k < count; ++k) {
      Ray& ray = rays_[static_cast<std::size_t>(k)] = Ray{};
      ray.origin = position;
      ray.direction = fibonacci_direction(k, count, turn);
      ray.t_near = 0;
      ray.t_far = std::numeric_limits<float>::infinity();
    }
    viewer_.trace(rays_, hits_);
    const auto backs =
        std::ranges::count_if(hits_, [&](const Hit& hit) { return meets_back(mesh_, hit); });
    if (static_cast<double>(backs) > kLargestBackPart * static_cast<double>(hits_.size())) {
      return std::nullopt;
    }
    const float solid_angle = 4 * std::numbers::pi_v<float> / static_cast<float>(rays_.size());
    ProbeView view = viewer_.sum_up(rays_, hits_, solid_angle);
    look_at_emitters(position, kEnoughRays * solid_angle, view);
    return view;
  }

 private:
  /// Emitters are small and bright, and a few rays more or less that meet one are visible. This
  /// replaces the part of `view` from emitters that it sees by less than the solid angle `enough`.
  void look_at_emitters(const Float3& position, float enough, ProbeView& view) {
    for (const EmitterPoints& emitter : emitters_) {
      auto seen = std::ranges::lower_bound(view.patches, emitter.patch, {},
                                           [](const auto& entry) { return entry.first; });
      const bool known = seen != view.patches.end() && seen->first == emitter.patch;
      if (known && spot_of(seen->second).amount * std::numbers::pi_v<float> >= enough) continue;
      const Harmonics weight = look_at(position, emitter);
      if (!(weight[0] > 0)) continue;
      if (!known) seen = view.patches.insert(seen, {emitter.patch, {}});
      seen->second = weight;
    }
  }

  Harmonics look_at(const Float3& position, const EmitterPoints& emitter) {
    point_rays_.clear();
    for (const EmitterPoint& point : emitter.point) {
      point_rays_.push_back(
          {.origin = position,
           .t_near = 0,
           .direction = to_float3(glm::normalize(to_glm(point.position) - to_glm(position))),
           .t_far = std::numeric_limits<float>::infinity()});
    }
    point_hits_.resize(point_rays_.size());
    viewer_.trace(point_rays_, point_hits_);
    Harmonics sum{};
    for (std::size_t k = 0; k < point_rays_.size(); ++k) {
      const EmitterPoint& point = emitter.point[k];
      const float way = glm::distance(to_glm(point.position), to_glm(position));
      const float facing = -glm::dot(to_glm(point.area), to_glm(point_rays_[k].direction));
      if (patch_at(mesh_, shown_patch_, point_hits_[k]) != emitter.patch || !(facing > 0) ||
          !(std::abs(point_hits_[k].t - way) <= kAtPoint * way)) {
        continue;
      }
      // A diffuse patch of radiosity B has the luminance B / pi.
      const float factor = facing / (way * way * std::numbers::pi_v<float>);
      const Harmonics y = spherical_harmonics(point_rays_[k].direction);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += factor * y[i];
    }
    return sum;
  }

  const DisplayMesh& mesh_;
  std::span<const std::uint32_t> shown_patch_;
  std::span<const EmitterPoints> emitters_;
  HarmonicViewer<kHarmonicCount> viewer_;
  std::vector<Ray> rays_, point_rays_;
  std::vector<Hit> hits_, point_hits_;
};

void append(const std::optional<ProbeView>& seen, LightProbes& probes) {
  probes.valid.push_back(seen ? 1 : 0);
  append_view(seen ? *seen : ProbeView(),
              "the probes see too much for one file; ask for fewer of them or for fewer rays",
              probes);
}

}  // namespace

LightProbes place_probes(const DisplayMesh& mesh, const ProbeSettings& settings) {
  const auto [low, high] = box_around(mesh.position);
  LightProbes probes;
  double total = 1;
  std::array<double, 3> count{};
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = static_cast<double>(high[axis]) - low[axis];
    count[axis] = settings.grid[0] > 0 ? settings.grid[axis]
                                       : std::max(1.0, std::round(extent / settings.spacing));
    total *= count[axis];
  }
  if (total > static_cast<double>(kMostProbes)) {
    throw Error(fmt::format("the grid has {:.0f} probes, the limit is {}; use a larger spacing",
                            total, kMostProbes));
  }
  for (int axis = 0; axis < 3; ++axis) {
    probes.grid[axis] = static_cast<std::uint32_t>(count[axis]);
  }
  for (std::uint32_t z = 0; z < probes.grid[2]; ++z) {
    for (std::uint32_t y = 0; y < probes.grid[1]; ++y) {
      for (std::uint32_t x = 0; x < probes.grid[0]; ++x) {
        const glm::vec3 part =
            (glm::vec3(x, y, z) + 0.5F) / glm::vec3(probes.grid[0], probes.grid[1], probes.grid[2]);
        probes.position.push_back(to_float3(glm::mix(low, high, part)));
      }
    }
  }
  return probes;
}

void trace_probes(const TransferData& data, std::span<const std::uint32_t> shown_patch,
                  const RayTracer& tracer, const ProbeSettings& settings, LightProbes& probes,
                  const Progress& progress) {
  if (settings.ray_count < kFewestProbeRays) {
    throw Error("light probes: a probe needs at least 64 rays");
  }
  probes.valid.clear();
  probes.sky.clear();
  probes.entry_begin = {0};
  probes.entry_patch.clear();
  probes.entry_weight.clear();
  probes.sky_cells = {.entry_begin = {0}, .entry_cell = {}, .entry_weight = {}};
  probes.patch_count = data.patches.size();
  const std::vector<EmitterPoints> emitters =
      spread_over_emitters(data, kMostPoints, kPointsPerRay * settings.ray_count);
  std::vector<std::optional<ProbeView>> views;
  for (std::size_t first = 0; first < probes.size(); first += kProbeBatch) {
    report_progress(progress, static_cast<double>(first) / static_cast<double>(probes.size()));
    const std::size_t count = std::min(kProbeBatch, probes.size() - first);
    views.resize(count);
    parallel_loop(
        count, 1,
        [&] { return ProbeViewer(data.mesh, shown_patch, tracer, emitters, settings.ray_count); },
        [&](std::size_t k, ProbeViewer& viewer) {
          views[k] = viewer.look_around(probes.position[first + k], first + k);
        });
    for (const std::optional<ProbeView>& view : views) append(view, probes);
  }
}

}  // namespace rebounce
