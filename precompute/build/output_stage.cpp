#include "precompute/build/output_stage.h"

#include "precompute/outputs/light_probes.h"
#include "precompute/outputs/lightmap.h"
#include "precompute/outputs/receiver_rows.h"
#include "precompute/outputs/reconstruction_weights.h"
#include "precompute/outputs/row_receivers.h"
#include "precompute/outputs/surface_harmonics.h"
#include "runtime/solvers/solve_radiosity.h"

namespace rebounce {

Lightmap make_lightmap(const PatchModel& model, const BuildSettings& settings,
                       BuildReport& report) {
  PlacedLightmap placed = place_lightmap(model, settings.lightmap);
  for (const std::string& warning : placed.warnings) {
    report.warnings.push_back(warning + ": it is left out of the lightmap");
  }
  return std::move(placed.lightmap);
}

void make_outputs(std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                  const BuildSettings& settings, TransferData& data, BuildReport& report,
                  PhaseClock& clock) {
  clock.run("weights", [&](const Progress& part) {
    compute_reconstruction_weights(shown_patch, data.patches.absorbed, tracer, data.mesh, part);
    return true;
  });
  const bool probes = settings.probes.grid[0] > 0 || settings.probes.spacing > 0;
  const bool harmonics = settings.surface_harmonics.ray_count > 0;
  if ((probes || harmonics) && !settings.receivers.empty()) {
    report.warnings.emplace_back(
        "light probes and surface harmonics see patches that are no receivers without their "
        "indirect light");
  }
  if (probes) {
    data.probes = clock.run("probes", [&](const Progress& part) {
      LightProbes placed = place_probes(data.mesh, settings.probes);
      trace_probes(data, shown_patch, tracer, settings.probes, placed, part);
      return placed;
    });
  }
  if (harmonics) {
    data.surface_harmonics = clock.run("surface harmonics", [&](const Progress& part) {
      return trace_surface_harmonics(data, shown_patch, tracer, settings.surface_harmonics, part);
    });
  }
}

void make_outputs_of_operator(std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                              const BuildSettings& settings, TransferData& data,
                              BuildReport& report, PhaseClock& clock) {
  data.emitted_irradiance = irradiance_from_emitters(data);
  ReceiverRowSettings rows = settings.receiver_rows;
  const auto make = [&](const char* phase, const RowReceivers& receivers) {
    return clock.run(phase, [&](const Progress& part) {
      return make_receiver_rows(data, shown_patch, receivers, tracer, rows,
                                settings.form_factors.seed, part);
    });
  };
  if (settings.receiver_rows.at_vertices) {
    MadeReceiverRows made = make("rows of vertices", VertexReceivers(data, shown_patch));
    data.receiver_rows = std::move(made.rows);
    report.error_without_rows = made.error_without;
  }
  if (settings.receiver_rows.at_texels) {
    rows.least_error = 0;  // they were asked for
    data.texel_rows = make("rows of texels", TexelReceivers(data, shown_patch)).rows;
  }
  if (!settings.receivers.empty() && !(data.receiver_rows.empty() && data.texel_rows.empty())) {
    report.warnings.emplace_back(
        "vertices and texels with rows of their own see patches that are no receivers without "
        "their indirect light");
  }
}

}  // namespace rebounce
