#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "rebounce/precompute/progress.h"
#include "rebounce/precompute/random_lights.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/transfer_data.h"

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
/// is asked for ReferenceSolver::kTogether of them at a time. In their order, less those from which
/// nothing arrives (arrives_nowhere). Throws Cancelled if asked to stop.
std::vector<LightError> light_errors(const TransferData& data,
                                     std::span<const std::vector<Float3>> lights,
                                     const TruthOf& truth_of, const Progress& progress = {});

/// Measures data.transfer under random lights of every kind that the scene has: what its sources
/// give off, at its receivers.
///
/// With `exact`, the operator in f32 that data.transfer was made from, the truth is what that one
/// gives, and there are 256 lights of a kind. Without it, the truth is that of ReferenceSolver on
/// the pairs of `data` under 16 lights of a kind, or else on its links under 64, to 1e-9; from
/// compressed form factors alone, which are a part of what is measured, it would be none.
std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const DenseOperator* exact, std::uint64_t seed,
                                     const Progress& progress = {});

/// The same without `exact`, with a solver that is there, on the pairs or the links of `data`.
std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const ReferenceSolver& reference, std::uint64_t seed,
                                     const Progress& progress = {});

}  // namespace rebounce
