#include "precompute/lights/measured_error.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>

#include "precompute/base/ranks.h"
#include "precompute/lights/error_bound.h"
#include "precompute/lights/error_reference.h"
#include "precompute/lights/reference_lighting.h"
#include "precompute/lights/reference_solution.h"
#include "precompute/lights/solve_batches.h"
#include "rebounce/error.h"
#include "runtime/rays/sampling.h"
#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

using Exitances = std::vector<std::vector<Float3>>;

// Lights of a kind for a compressed operator (lab/049), and for an operator that has rounding
// errors alone.
constexpr int kLightCount = 256, kRoundedLightCount = 16;

// Against an exact operator point lights are cheap. The lamps that err most light one or two
// patches (lab/103): large scenes have more of them, up to this many groups of kLightCount lights
// (lab/136).
constexpr std::size_t kPatchesOfGroup = 1024, kMostGroups = 4;

std::size_t point_light_groups(std::size_t patch_count) {
  return std::clamp<std::size_t>(patch_count / kPatchesOfGroup, 1, kMostGroups);
}

// Lights whose truth is asked for at a time.
constexpr std::size_t kLightsTogether = 64;

// Residuals of the reference: relative to the initial exitance, where rounding errors are above it;
// and relative to the reflected light, in parts of the tolerance, where it changes an error by a
// thousandth at most (lab/049).
constexpr double kReferenceResidual = 1e-10, kResidualOfTolerance = 0.02;

/// The seed of a group of lights; the first keeps that of the check.
std::uint64_t group_seed(std::uint64_t seed, std::size_t group) {
  return group == 0 ? seed : mix_bits(seed + group);
}

KindError summary(LightKind kind, std::size_t light_count, const std::vector<double>& errors) {
  const double sum = std::accumulate(errors.begin(), errors.end(), 0.0);
  return {kind,
          static_cast<int>(errors.size()),
          static_cast<int>(light_count - errors.size()),
          sum / static_cast<double>(errors.size()),
          std::ranges::max(errors),
          error_bound(errors)};
}

/// Returns the errors of lights of a kind, without those from which nothing arrives.
using ErrorsOf = std::function<std::vector<double>(LightKind, const Exitances&, const Progress&)>;

/// How many lights are measured: so many of a kind at a time, and point lights in several groups.
struct LightCounts {
  int of_group = kLightCount;
  std::size_t point_groups = 1;

  std::size_t groups(LightKind kind) const { return kind == LightKind::kPoint ? point_groups : 1; }
  std::size_t all_groups() const { return kLightKinds.size() - 1 + point_groups; }
};

std::vector<KindError> measure(const TransferData& data, const RayTracer& tracer,
                               const LightCounts& counts, std::uint64_t seed,
                               const ErrorsOf& errors_of, const Progress& progress) {
  std::vector<KindError> result;
  std::size_t groups_done = 0;
  const auto total = static_cast<double>(counts.all_groups());
  const Progress part = [&](double done) {
    return !progress || progress((static_cast<double>(groups_done) + done) / total);
  };
  for (const LightKind kind : kLightKinds) {
    std::vector<double> errors;
    std::size_t light_count = 0;
    for (std::size_t group = 0; group < counts.groups(kind); ++group, ++groups_done) {
      if (!part(0)) throw Cancelled();
      const Exitances lights = random_initial_exitances(
          data, tracer, kind, counts.of_group, group_seed(seed, group), data.transfer->roles());
      light_count += lights.size();
      std::ranges::copy(errors_of(kind, lights, part), std::back_inserter(errors));
    }
    if (!errors.empty()) result.push_back(summary(kind, light_count, errors));
  }
  return result;
}

/// The errors of `light_count` lights of each kind.
std::vector<KindError> measure_against(const TransferData& data, const RayTracer& tracer,
                                       const IrradiancesOf& truth_of, const LightCounts& counts,
                                       std::uint64_t seed, const Progress& progress,
                                       const LightListener& on_point_light) {
  const auto errors_of = [&](LightKind kind, const Exitances& lights, const Progress& part) {
    std::vector<double> errors;
    const LightListener& on_light = kind == LightKind::kPoint ? on_point_light : LightListener();
    for (const LightError& light : light_errors(data, lights, truth_of, part, on_light)) {
      errors.push_back(light.error);
    }
    return errors;
  };
  return measure(data, tracer, counts, seed, errors_of, progress);
}

}  // namespace

std::vector<LightError> light_errors(const TransferData& data,
                                     std::span<const std::vector<Float3>> lights,
                                     const IrradiancesOf& truth_of, const Progress& progress,
                                     const LightListener& on_light) {
  const std::vector<float>& area = data.patches.area;
  std::vector<Float3> indirect_irradiance(data.patches.size());
  std::vector<float> workspace(data.transfer->workspace_size());
  ErrorReference received;
  std::vector<double> distances;
  std::vector<LightError> errors;
  for (std::size_t done = 0; done < lights.size(); done += kLightsTogether) {
    report_progress(progress, static_cast<double>(done) / lights.size());
    const auto some = lights.subspan(done, std::min(lights.size() - done, kLightsTogether));
    auto truths = truth_of(some);
    for (std::size_t k = 0; k < some.size(); ++k) {
      if (arrives_nowhere(truths[k], some[k], area)) continue;
      data.transfer->apply(some[k], indirect_irradiance, workspace);
      if (on_light) on_light(some[k], truths[k], indirect_irradiance);
      const double all = area_norm(truths[k], area);
      data.transfer->roles().keep(PatchRoles::kReceiver, truths[k]);
      const double seen = area_norm(truths[k], area);
      received.add(seen, all);
      errors.push_back({.arriving = seen / area_norm(some[k], area), .light = done + k});
      distances.push_back(area_distance(indirect_irradiance, truths[k], area));
    }
  }
  for (std::size_t k = 0; k < errors.size(); ++k) errors[k].error = received.error(k, distances[k]);
  return errors;
}

std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const DenseOperator* exact, std::uint64_t seed,
                                     const Progress& progress) {
  if (exact == nullptr && data.exchange.empty() && data.links.empty()) {
    throw Error(
        "measured error: the data hold neither pairs nor links for a reference; store links");
  }
  if (exact == nullptr) {
    const ReferenceSolver reference(data);
    const auto truth_of = [&](std::span<const std::vector<Float3>> lights) {
      return solve_batches(lights, {}, [&](std::span<const std::vector<Float3>> some) {
        return reference.indirect_irradiances(some, kReferenceResidual);
      });
    };
    return measure_against(data, tracer, truth_of, {.of_group = kRoundedLightCount}, seed, progress,
                           {});
  }
  const auto errors_of = [&](LightKind, const Exitances& lights, const Progress&) {
    return ReferenceLighting(DenseMatrix(*exact, data.transfer->roles()), lights)
        .errors(*data.transfer);
  };
  const LightCounts counts{.point_groups = point_light_groups(data.patches.size())};
  return measure(data, tracer, counts, seed, errors_of, progress);
}

double reference_residual(double tolerance) {
  return kResidualOfTolerance * tolerance;
}

std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const IrradiancesOf& truth_of, std::uint64_t seed,
                                     const Progress& progress,
                                     const LightListener& on_point_light) {
  return measure_against(data, tracer, truth_of, {}, seed, progress, on_point_light);
}

}  // namespace rebounce
