#include <array>

#include "bench/reference/compare.h"
#include "bench/reference/error_sum.h"
#include "bench/reference/scene_surface.h"
#include "rebounce/error.h"
#include "runtime/rays/cumulative_choice.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/sampling.h"

namespace rebounce::reference {
namespace {

/// A patch that was chosen, and the area it stands for.
struct ChosenPatch {
  std::uint32_t patch;
  double weight;  ///< m²
};

/// All patches, or `count` of them by systematic sampling: a patch larger than the step is taken as
/// often as steps fall on it, once with their weights together.
std::vector<ChosenPatch> choose_patches(std::span<const float> area, std::size_t count,
                                        std::uint64_t seed) {
  std::vector<ChosenPatch> chosen;
  const bool all = count == 0 || count >= area.size();
  double total = 0, passed = 0;
  for (const float a : area) total += a;
  const double step = total / static_cast<double>(all ? area.size() : count);
  const double offset = unit_square(mix_bits(seed)).x;
  std::size_t steps = 0;
  for (std::uint32_t i = 0; i < area.size(); ++i) {
    if (all) {
      chosen.push_back({i, area[i]});
      continue;
    }
    passed += area[i];
    const std::size_t steps_before = steps;
    while ((static_cast<double>(steps) + offset) * step < passed) ++steps;
    if (steps > steps_before) {
      chosen.push_back({i, static_cast<double>(steps - steps_before) * step});
    }
  }
  return chosen;
}

/// Points on the display triangles of the patches.
class PatchSampler {
 public:
  explicit PatchSampler(const TransferData& data)
      : mesh_(data.mesh), triangles_(data.mesh.triangle_patch, data.patches.size()) {}

  bool has_any(std::uint32_t patch) const { return !triangles_[patch].empty(); }

  /// Appends `count` points on `patch`, evenly spread by area, for each of kReplicateCount
  /// independent replicates.
  void append_points(std::uint32_t patch, std::uint32_t count, std::uint64_t seed,
                     std::vector<SurfacePoint>& points) const {
    CumulativeChoice choice;
    for (const std::uint32_t t : triangles_[patch]) choice.add(area_of(corners_of(mesh_, t)));
    for (std::uint32_t r = 0; r < kReplicateCount; ++r) {
      const glm::dvec2 shift = unit_square(mix_bits(mix_bits(seed ^ mix_bits(patch)) + r));
      for (std::uint32_t k = 0; k < count; ++k) {
        const glm::dvec2 square = r2_point(k, shift);
        const auto [index, rest] = choice.choose(square.x);
        points.push_back(point_on(triangles_[patch][index], {rest, square.y}));
      }
    }
  }

 private:
  SurfacePoint point_on(std::uint32_t t, const glm::dvec2& square) const {
    const glm::dvec2 b = square_to_triangle(square);
    const TriangleCorners corners = corners_of(mesh_, t);
    return {.position = to_float3(point_at(corners, b)),
            .normal = to_float3(front_normal(corners)),
            .triangle = t,
            .barycentric = {static_cast<float>(b.x), static_cast<float>(b.y)}};
  }

  const DisplayMesh& mesh_;
  PatchTriangles triangles_;
};

struct PatchMean {
  Float3 mean, standard_error;
};

/// The mean over a patch's points and its standard error, from the spread of the replicates' means.
PatchMean mean_over(std::span<const Float3> value, std::uint32_t points_per_replicate) {
  constexpr double kReplicates = kReplicateCount;
  std::array<glm::dvec3, kReplicateCount> replicate{};
  for (std::size_t k = 0; k < value.size(); ++k) {
    replicate[k / points_per_replicate] +=
        to_dvec3(value[k]) / static_cast<double>(points_per_replicate);
  }
  glm::dvec3 mean(0), spread(0);
  for (const glm::dvec3& r : replicate) mean += r / kReplicates;
  for (const glm::dvec3& r : replicate) spread += (r - mean) * (r - mean);
  return {to_float3(mean), to_float3(glm::sqrt(spread / (kReplicates * (kReplicates - 1))))};
}

void check(const TransferData& data, std::span<const Float3> indirect_irradiance) {
  if (indirect_irradiance.size() == data.patches.size()) return;
  throw Error("comparison of patch means: the indirect irradiance must have one entry per patch");
}

}  // namespace

PatchComparison compare_patch_means(const TransferData& data,
                                    std::span<const Float3> indirect_irradiance,
                                    const LitScene& lit_scene,
                                    const PatchComparisonSettings& settings,
                                    const Progress& progress) {
  check(data, indirect_irradiance);
  const PatchSampler sampler(data);
  std::vector<ChosenPatch> chosen =
      choose_patches(data.patches.area, settings.patch_count, settings.seed);
  const std::size_t left_out =
      std::erase_if(chosen, [&](const ChosenPatch& c) { return !sampler.has_any(c.patch); });
  if (chosen.empty()) throw Error("comparison of patch means: no patch has a triangle");

  const std::uint32_t per_replicate =
      std::max(1U, (settings.points_per_patch + kReplicateCount - 1) / kReplicateCount);
  const std::size_t per_patch = std::size_t{per_replicate} * kReplicateCount;
  std::vector<SurfacePoint> points;
  points.reserve(chosen.size() * per_patch);
  for (const ChosenPatch& c : chosen) {
    sampler.append_points(c.patch, per_replicate, settings.seed, points);
  }
  const IrradianceEstimate estimate = reference::indirect_irradiance(
      lit_scene, points, settings.samples_per_point, settings.seed, progress);

  PatchComparison comparison;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const std::uint32_t patch = chosen[k].patch;
    const PatchMean truth =
        mean_over(std::span(estimate.mean).subspan(k * per_patch, per_patch), per_replicate);
    comparison.patch.push_back(patch);
    comparison.truth.push_back(truth.mean);
    comparison.standard_error.push_back(truth.standard_error);
    comparison.weight.push_back(chosen[k].weight);
  }
  comparison.relative.left_out_count = left_out;
  comparison.relative = compare_patch_means(comparison, indirect_irradiance);
  return comparison;
}

RelativeError compare_patch_means(const PatchComparison& traced,
                                  std::span<const Float3> indirect_irradiance) {
  ErrorSum sum;
  for (std::size_t k = 0; k < traced.patch.size(); ++k) {
    sum.add(traced.weight[k], indirect_irradiance[traced.patch[k]], traced.truth[k],
            traced.standard_error[k]);
  }
  return sum.result(traced.relative.left_out_count);
}

}  // namespace rebounce::reference
