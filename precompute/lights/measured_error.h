#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce {

/// Relative area-weighted L2 errors of the indirect irradiance under random lights of one kind.
struct KindError {
  LightKind kind = LightKind::kPoint;
  int light_count = 0;  ///< with an error
  int dark_count = 0;   ///< left out, as nothing of them arrives (arrives_nowhere)
  double mean = 0;
  double max = 0;
  double bound = 0;  ///< with 95 % probability above those of 1,000 more lights: error_bound.h
};

/// How far off an operator is under one light.
struct LightError {
  double error = 0;     ///< relative area-weighted L2 error of the indirect irradiance at receivers
  double arriving = 0;  ///< area norm of what arrives at receivers, of what the light gives off
};

/// What arrives [n] in lx of some lights, which are initial exitances [n] in lx.
using TruthOf =
    std::function<std::vector<std::vector<Float3>>(std::span<const std::vector<Float3>>)>;

/// That of data.transfer under `lights`, each what its sources give off, against `truth_of`, which
/// is asked for ReferenceSolver::kBatchLights of them at a time. In their order, less those from
/// which nothing arrives (arrives_nowhere). Throws Cancelled if asked to stop.
std::vector<LightError> light_errors(const TransferData& data,
                                     std::span<const std::vector<Float3>> lights,
                                     const TruthOf& truth_of, const Progress& progress = {});

/// Measures data.transfer under random lights of every kind that the scene has: what its sources
/// give off, at its receivers.
///
/// With `exact`, the operator in f32 that data.transfer was made from, the truth is what that one
/// gives, and there are 256 lights of a kind. Without it, data.transfer has rounding errors alone:
/// the truth is that of ReferenceSolver on the pairs or the links of `data` to 1e-10, under 16
/// lights of a kind. From compressed form factors alone, which are a part of what is measured, it
/// would be none.
std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const DenseOperator* exact, std::uint64_t seed,
                                     const Progress& progress = {});

/// Of an operator of `tolerance` that was made from links: the truth is that of `reference`, which
/// solves with them, so much closer than the tolerance that no error changes by a thousandth; 256
/// lights of a kind. With a tolerance of 0, rounding errors are measured, as above.
std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const ReferenceSolver& reference, double tolerance,
                                     std::uint64_t seed, const Progress& progress = {});

}  // namespace rebounce
