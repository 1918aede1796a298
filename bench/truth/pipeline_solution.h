#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/reference/compare.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::reference {

struct PipelineSettings {
  std::size_t patch_count = 1000;
  FormFactorQuality quality = FormFactorQuality::kDefault;
  int direct_points = 0;  ///< of a patch at which lamps are looked at
  ReceiverRowSettings receiver_rows{.at_vertices = false, .least_error = 0};
  /// The lamps that the build takes for the scene's own; by default those of the asset.
  std::optional<std::vector<Light>> own_lights{};
  double lamp_weight = SubdivisionSettings{}.lamp_weight;
};

/// One number of patches: its form factors, and their light.
struct Solution {
  TransferData data;
  RayTracer tracer;                         ///< the surface of data.mesh
  std::vector<Float3> indirect_irradiance;  ///< [n] lx
  std::vector<Float3> radiosity;            ///< [n] lx
};

/// Solves the scene of a file under these lights with the form factors themselves: an operator adds
/// its own error, and many patches take long to invert. Throws Error if the scene cannot be used,
/// Cancelled if asked to stop.
Solution solve_scene(const std::string& scene, const PipelineSettings& settings,
                     std::span<const Light> lights, const Sky& sky, const BuildProgress& progress);

/// Draws |H - truth| of the compared patches, as a part of the truth's root mean square, into a
/// picture (.png). Throws Error if it cannot be written.
void draw_error(const Solution& solution, const PatchComparison& patches, const std::string& path);

}  // namespace rebounce::reference
