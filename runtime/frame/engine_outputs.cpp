// The light of a frame: outputs.h by way of the maps in runtime/outputs.

#include "rebounce/error.h"
#include "rebounce/outputs.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/probe_light.h"
#include "runtime/outputs/texel_light.h"
#include "runtime/outputs/vertex_light.h"

namespace rebounce {
namespace {

/// Writes the indirect irradiance at the vertices, which may be below 0.
void write_unclamped(const Engine& engine, std::span<Float3> irradiance) {
  const Engine::Parts& parts = engine.parts();
  reconstruct_at_vertices(parts.data->mesh, parts.indirect_irradiance, irradiance, parts.scheduler);
  parts.receiver_products.add(parts.radiosity, irradiance, parts.scheduler);
}

}  // namespace

void vertex_irradiance(const Engine& engine, std::span<Float3> irradiance) {
  if (engine.data().receiver_rows.empty()) {
    light_at_vertices(engine.data().mesh, engine.indirect_irradiance(), irradiance,
                      engine.scheduler());
    return;
  }
  const OneThread guard(engine.parts().use);
  write_unclamped(engine, irradiance);
  clamp_light(irradiance, engine.scheduler());
}

void vertex_direct_irradiance(const Engine& engine, std::span<Float3> irradiance) {
  light_at_vertices(engine.data().mesh, engine.direct_irradiance(), irradiance, engine.scheduler());
}

void vertex_light(Engine& engine, std::span<SurfaceLight> light) {
  const OneThread guard(engine.parts().use);
  const TransferData& data = engine.data();
  if (data.surface_harmonics.empty()) {
    throw Error("the transfer file has no surface harmonics; make it with --surface-harmonics");
  }
  const std::span<SurfaceLight> patch_light = engine.parts().patch_light;
  apply_surface_harmonics(data.surface_harmonics, engine.radiosity(), engine.sky(), patch_light,
                          engine.scheduler());
  reconstruct_at_vertices(data.mesh, patch_light, light, engine.scheduler());
}

void lightmap_irradiance(Engine& engine, std::span<Float3> irradiance) {
  const OneThread guard(engine.parts().use);
  const TransferData& data = engine.data();
  if (data.lightmap.empty()) {
    throw Error("the transfer file has no lightmap; make it with --lightmap");
  }
  const std::span<Float3> at_vertices = engine.parts().vertex_irradiance;
  // Clamped after the interpolation, not before it.
  write_unclamped(engine, at_vertices);
  if (data.texel_rows.empty()) {
    light_at_texels(data.lightmap, data.mesh, at_vertices, irradiance, engine.scheduler());
    return;
  }
  interpolate_at_texels(data.lightmap, data.mesh, at_vertices, irradiance, engine.scheduler());
  engine.parts().texel_products.add(engine.radiosity(), irradiance, engine.scheduler());
  clamp_light(irradiance, engine.scheduler());
}

void probe_light(const Engine& engine, std::span<ProbeLight> light) {
  apply_probes(engine.data().probes, engine.radiosity(), engine.sky(), light, engine.scheduler());
}

void probe_light(const Engine& engine, std::span<QuadraticProbeLight> light) {
  apply_probes(engine.data().probes, engine.radiosity(), engine.sky(), light, engine.scheduler());
}

void probe_irradiance(const Engine& engine, std::span<const Float3> normals,
                      std::span<Float3> irradiance) {
  irradiance_at_probes(engine.data().probes, engine.radiosity(), engine.sky(), normals, irradiance,
                       engine.scheduler());
}

ProbeLight light_in_air(const Engine& engine, const Float3& position) {
  return gather_probe_light(engine.data().probes, engine.radiosity(), engine.sky(), position);
}

void irradiance_in_air(const Engine& engine, const Float3& position,
                       std::span<const Float3> normals, std::span<Float3> irradiance) {
  irradiance_in_air(engine.data().probes, engine.radiosity(), engine.sky(), position, normals,
                    irradiance);
}

}  // namespace rebounce
