// rebounce.h: the light of the last frame at vertices, texels and probes.

#include "rebounce/outputs.h"
#include "runtime/frame/c_handles.h"

namespace rebounce::c {
namespace {

static_assert(sizeof(SurfaceLight) == 12 * sizeof(float));
static_assert(sizeof(QuadraticProbeLight) == 27 * sizeof(float));
static_assert(sizeof(ProbeLight) == 54 * sizeof(float));

/// Calls write(engine, values) with `count` entries of an output.
template <typename Value, typename Handle, typename Write>
rebounce_status write_output(const char* function, Handle* engine, float* values, std::size_t count,
                             const Write& write) noexcept {
  if (engine == nullptr || values == nullptr) return missing(function);
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    write(engine->engine, std::span(reinterpret_cast<Value*>(values), count));
    return REBOUNCE_OK;
  });
}

template <typename Light>
void write_irradiance(const float* harmonics, const float* normal, float* irradiance) {
  if (harmonics == nullptr || normal == nullptr || irradiance == nullptr) return;
  Light light;
  std::memcpy(light.data(), harmonics, sizeof(light));
  std::ranges::copy(probe_irradiance(light, triple(normal)), irradiance);
}

}  // namespace

extern "C" {

rebounce_status rebounce_engine_vertex_irradiance(const rebounce_engine* engine, float* irradiance,
                                                  size_t vertex_count) {
  return write_output<Float3>("rebounce_engine_vertex_irradiance", engine, irradiance, vertex_count,
                              vertex_irradiance);
}

rebounce_status rebounce_engine_vertex_direct_irradiance(const rebounce_engine* engine,
                                                         float* irradiance, size_t vertex_count) {
  return write_output<Float3>("rebounce_engine_vertex_direct_irradiance", engine, irradiance,
                              vertex_count, vertex_direct_irradiance);
}

rebounce_status rebounce_engine_vertex_light(rebounce_engine* engine, float* harmonics,
                                             size_t vertex_count) {
  return write_output<SurfaceLight>("rebounce_engine_vertex_light", engine, harmonics, vertex_count,
                                    vertex_light);
}

void rebounce_bent_irradiance(const float* harmonics, const float* irradiance, const float* normal,
                              const float* bent, float* result) {
  if (harmonics == nullptr || irradiance == nullptr || normal == nullptr || bent == nullptr ||
      result == nullptr) {
    return;
  }
  SurfaceLight light;
  std::memcpy(light.data(), harmonics, sizeof(light));
  std::ranges::copy(bent_irradiance(light, triple(irradiance), triple(normal), triple(bent)),
                    result);
}

rebounce_status rebounce_engine_lightmap_irradiance(rebounce_engine* engine, float* irradiance,
                                                    size_t texel_count) {
  return write_output<Float3>("rebounce_engine_lightmap_irradiance", engine, irradiance,
                              texel_count, lightmap_irradiance);
}

rebounce_status rebounce_engine_probe_light(const rebounce_engine* engine, float* harmonics,
                                            size_t probe_count) {
  return write_output<QuadraticProbeLight>(
      "rebounce_engine_probe_light", engine, harmonics, probe_count,
      [](const Engine& of, std::span<QuadraticProbeLight> light) { probe_light(of, light); });
}

rebounce_status rebounce_engine_probe_light_to_degree_4(const rebounce_engine* engine,
                                                        float* harmonics, size_t probe_count) {
  return write_output<ProbeLight>(
      "rebounce_engine_probe_light_to_degree_4", engine, harmonics, probe_count,
      [](const Engine& of, std::span<ProbeLight> light) { probe_light(of, light); });
}

void rebounce_harmonics_irradiance(const float* harmonics, const float* normal, float* irradiance) {
  write_irradiance<QuadraticProbeLight>(harmonics, normal, irradiance);
}

void rebounce_harmonics_irradiance_to_degree_4(const float* harmonics, const float* normal,
                                               float* irradiance) {
  write_irradiance<ProbeLight>(harmonics, normal, irradiance);
}

rebounce_status rebounce_engine_probe_irradiance(const rebounce_engine* engine,
                                                 const float* normals, size_t normal_count,
                                                 float* irradiance, size_t probe_count) {
  if (normals == nullptr) return missing("rebounce_engine_probe_irradiance");
  return write_output<Float3>(
      "rebounce_engine_probe_irradiance", engine, irradiance, probe_count * normal_count,
      [&](const Engine& of, std::span<Float3> at_probes) {
        probe_irradiance(of, {reinterpret_cast<const Float3*>(normals), normal_count}, at_probes);
      });
}

void rebounce_octahedral_normals(size_t size, float* normals) {
  if (normals == nullptr) return;
  write_octahedral_normals(size, {reinterpret_cast<Float3*>(normals), size * size});
}

}  // extern "C"

}  // namespace rebounce::c
