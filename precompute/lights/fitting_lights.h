#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rebounce/scene_data.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The lights that an operator is fitted to, each an initial exitance [n] in lx.
struct FittingLights {
  /// Training lights. Errors under lights like these weigh more than others.
  std::vector<std::vector<Float3>> training;
  /// Validation lights: the tolerance must hold for these. They differ from the training lights;
  /// otherwise the measured error is too small.
  std::vector<std::vector<Float3>> validation;
};

/// The largest numbers of lights: those of an open scene with lamps of its own.
inline constexpr std::size_t kMostTrainingLights = 193, kMostValidationLights = 513;

/// Bytes per patch of the lights while an operator is fitted to them: the light and its result; for
/// training lights also their directions on clusters.
inline constexpr std::size_t kFittingLightBytes =
    2 * sizeof(Float3) * (kMostTrainingLights + kMostValidationLights) +
    sizeof(double) * kMostTrainingLights;

/// Draws the training lights of a scene: point lights, spot lights, in an open scene suns, and last
/// the light of the scene's own lamps and emitters together. All are cut to what sources emit. The
/// same `seed` gives the same lights.
std::vector<std::vector<Float3>> draw_training_lights(const TransferData& data,
                                                      const RayTracer& tracer, std::uint64_t seed,
                                                      const PatchRoles& roles = {});

/// Draws the same and validation lights, which are first the last of them, and then other point
/// lights.
FittingLights draw_fitting_lights(const TransferData& data, const RayTracer& tracer,
                                  std::uint64_t seed, const PatchRoles& roles = {});

}  // namespace rebounce
