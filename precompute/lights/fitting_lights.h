#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/rays/ray_tracer.h"
#include "transfer/data/patch_roles.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Lights that the operator is fitted to, each an initial exitance [n] in lx.
struct FittingLights {
  /// What light patches give off: errors in what such lights do weigh more than others.
  std::span<const std::vector<Float3>> training;
  /// Those that the tolerance is held under. Others than the first, or the error looks smaller than
  /// it is.
  std::span<const std::vector<Float3>> validation;
};

/// Lights drawn to fit an operator to, each an initial exitance [n] in lx.
struct DrawnLights {
  std::vector<std::vector<Float3>> training, validation;

  /// Valid as long as this lives and stays as it is.
  FittingLights view() const { return {training, validation}; }
};

/// How many there are at most: in an open scene, with its own lamps.
inline constexpr std::size_t kMostTrainingLights = 193, kMostValidationLights = 513;

/// Draws the lights that the operator of a scene is fitted to: points, spots and, where it is open,
/// suns to shape it, other points to judge it, and for both the light of the scene's own lamps,
/// which judge first; all as far as sources give them off. The same `seed`, the same lights.
DrawnLights draw_fitting_lights(const TransferData& data, const RayTracer& tracer,
                                std::uint64_t seed, const PatchRoles& roles = {});

}  // namespace rebounce
