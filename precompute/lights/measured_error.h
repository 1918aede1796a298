#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/solve_batches.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce {

/// Relative area-weighted L2 errors of the indirect irradiance under random lights of one kind.
struct KindError {
  LightKind kind = LightKind::kPoint;
  int light_count = 0;  ///< lights that have an error
  int dark_count = 0;   ///< lights from which nothing arrives (arrives_nowhere)
  double mean = 0;
  double max = 0;
  double bound = 0;  ///< one in 80 further errors may be above: error_bound.h
};

/// The error of an operator under one light.
struct LightError {
  double error = 0;  ///< relative area-weighted L2 error of the indirect irradiance at receivers
  /// Area norm of the light that arrives at receivers, relative to that of the emitted light.
  double arriving = 0;
  std::size_t light = 0;  ///< its place among the lights
};

/// Called for each light that has an error, in order: its initial exitance, the reference on all
/// patches, and what data.transfer gives, all [n] in lx.
using LightListener =
    std::function<void(std::span<const Float3> initial_exitance, std::span<const Float3> truth,
                       std::span<const Float3> result)>;

/// The errors of data.transfer under `lights`, each cut to what sources emit, against `truth_of`.
/// It is called for some dozens of lights at a time. The errors keep the order of the lights;
/// lights from which nothing arrives (arrives_nowhere) are left out. Throws Cancelled if asked to
/// stop.
std::vector<LightError> light_errors(const TransferData& data,
                                     std::span<const std::vector<Float3>> lights,
                                     const IrradiancesOf& truth_of, const Progress& progress = {},
                                     const LightListener& on_light = {});

/// Measures data.transfer under random lights of every kind that the scene has: light of its
/// sources, at its receivers.
///
/// With `exact`, the operator in f32 that data.transfer was compressed from, that operator is the
/// reference, and there are 256 lights of a kind; of point lights one for every four patches, up to
/// 1,024. Without it, data.transfer has rounding errors
/// alone: the reference is ReferenceSolver on the pairs or the links of `data` to 1e-10, with 16
/// lights of a kind. `data` must then hold pairs or links: compressed form factors are no
/// reference, because their error is part of what is measured.
std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const DenseOperator* exact, std::uint64_t seed,
                                     const Progress& progress = {});

/// The reference of an operator of `tolerance` is so exact that no error changes by a thousandth:
/// what it is off at the most, relative to the light that arrives.
double reference_residual(double tolerance);

/// Measures an operator that was made from links against `truth_of`, which solves with these links
/// to reference_residual(); 256 lights of a kind. `on_point_light` is called for point lights.
std::vector<KindError> measure_error(const TransferData& data, const RayTracer& tracer,
                                     const IrradiancesOf& truth_of, std::uint64_t seed,
                                     const Progress& progress = {},
                                     const LightListener& on_point_light = {});

}  // namespace rebounce
