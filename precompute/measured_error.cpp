#include "rebounce/precompute/measured_error.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "error_bound.h"
#include "lit_truth.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Exitances = std::vector<std::vector<Float3>>;

// Against the dense inverse, against pairs, of an operator that has rounding errors alone, and
// against links.
constexpr int kLightCount = 256, kReferenceLightCount = 16, kLinkedLightCount = 64;
constexpr double kReferenceResidual = 1e-9;

/// Against an iterative solution. Throws Cancelled if asked to stop.
std::vector<double> errors_by_reference(const TransferData& data, const ReferenceSolver& reference,
                                        const Exitances& lights, const Progress& progress) {
  std::vector<Float3> indirect_irradiance(data.patches.size());
  std::vector<float> workspace(data.transfer->workspace_size());
  std::vector<double> errors;
  for (std::size_t done = 0; done < lights.size(); done += ReferenceSolver::kTogether) {
    if (progress && !progress(static_cast<double>(done) / lights.size())) throw Cancelled();
    const auto some = std::span(lights).subspan(
        done, std::min<std::size_t>(lights.size() - done, ReferenceSolver::kTogether));
    auto truths = reference.indirect_irradiances(some, kReferenceResidual);
    for (std::size_t k = 0; k < some.size(); ++k) {
      data.transfer->roles().keep(PatchRoles::kReceiver, truths[k]);
      if (arrives_nowhere(truths[k], some[k], data.patches.area)) continue;
      data.transfer->apply(some[k], indirect_irradiance, workspace);
      errors.push_back(relative_difference(indirect_irradiance, truths[k], data.patches.area));
    }
  }
  return errors;
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

/// The errors of lights, less those from which nothing arrives.
using ErrorsOf = std::function<std::vector<double>(const Exitances&, const Progress&)>;

std::vector<KindError> measure(const TransferData& data, const RayTracer& tracer, int light_count,
                               std::uint64_t seed, const ErrorsOf& errors_of,
                               const Progress& progress) {
  std::vector<KindError> result;
  for (std::size_t k = 0; k < kLightKinds.size(); ++k) {
    const Progress part = [&](double done) {
      return !progress || progress((k + done) / kLightKinds.size());
    };
    if (!part(0)) throw Cancelled();
    const LightKind kind = kLightKinds[k];
    const Exitances lights =
        random_initial_exitances(data, tracer, kind, light_count, seed, data.transfer->roles());
    const std::vector<double> errors = errors_of(lights, part);
    if (!errors.empty()) result.push_back(summary(kind, lights.size(), errors));
  }
  return result;
}

}  // namespace

std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const DenseOperator* exact, std::uint64_t seed,
                                     const Progress& progress) {
  if (exact == nullptr && data.exchange.empty() && data.links.empty()) {
    throw Error("measured error: there is no truth without pairs or links; store links too");
  }
  if (exact == nullptr) return measure_error(data, tracer, ReferenceSolver(data), seed, progress);
  const auto errors_of = [&](const Exitances& lights, const Progress&) {
    return LitTruth(DenseMatrix(*exact, data.transfer->roles()), lights).errors(*data.transfer);
  };
  return measure(data, tracer, kLightCount, seed, errors_of, progress);
}

std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const ReferenceSolver& reference, std::uint64_t seed,
                                     const Progress& progress) {
  const auto errors_of = [&](const Exitances& lights, const Progress& part) {
    return errors_by_reference(data, reference, lights, part);
  };
  return measure(data, tracer, data.exchange.empty() ? kLinkedLightCount : kReferenceLightCount,
                 seed, errors_of, progress);
}

}  // namespace rebounce
