// rebounce.h: frames on the graphics card.

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "runtime/frame/c_handles.h"

// NOLINTBEGIN(readability-identifier-naming): the names of a C interface

struct rebounce_gpu_engine {
  rebounce::GpuEngine engine;
  std::vector<rebounce::GpuLamp> lamps{};  ///< of the current frame
};

// NOLINTEND(readability-identifier-naming)

namespace rebounce::c {
namespace {

// The size of the first version of the structure.
constexpr std::size_t kGpuBuffersSize1 =
    offsetof(rebounce_gpu_buffers, probe_light) + sizeof(std::uint32_t);

constexpr std::size_t kGpuLampSize1 = offsetof(rebounce_gpu_lamp, depth_range) + sizeof(Float2);

static_assert(static_cast<int>(GpuShadowMap::kPlane) == REBOUNCE_GPU_PLANE &&
              static_cast<int>(GpuShadowMap::kLayers) == REBOUNCE_GPU_LAYERS &&
              static_cast<int>(GpuShadowMap::kCube) == REBOUNCE_GPU_CUBE);
static_assert(sizeof(rebounce_gpu_shadow_view) == sizeof(GpuShadowView) &&
              offsetof(rebounce_gpu_shadow_view, layer) == offsetof(GpuShadowView, layer));

/// Reads lamp k of an array whose entries have the size that the caller states.
GpuLamp gpu_lamp_at(const rebounce_gpu_lamp* lamps, std::size_t k) {
  constexpr const char* kInit = "rebounce_gpu_lamp_init";
  rebounce_gpu_lamp defaults;
  rebounce_gpu_lamp_init(&defaults);
  check_struct_size(stated_size(lamps), kGpuLampSize1, kInit);
  const char* const entry = reinterpret_cast<const char*>(lamps) + k * stated_size(lamps);
  const std::string name = "lamp " + std::to_string(k);
  if (stated_size(entry) != stated_size(lamps)) {
    throw Error(name + " has another struct_size than the first; fill it with " + kInit);
  }
  const rebounce_gpu_lamp given = take(entry, defaults, kGpuLampSize1, kInit);
  if (given.light == nullptr) throw Error(name + " has no light");
  if (given.shadow_map > REBOUNCE_GPU_CUBE) {
    throw Error(name + " has a shadow map of kind " + std::to_string(given.shadow_map) +
                ", which does not exist; give one of rebounce_gpu_shadow_map");
  }
  GpuLamp lamp;
  try {
    take_light(given.light, 0, lamp.light);
  } catch (const Error& error) {
    throw Error(name + ": " + error.what());
  }
  lamp.shadow_map = static_cast<GpuShadowMap>(given.shadow_map);
  lamp.texture = given.texture;
  if (given.views != nullptr)
    lamp.views = {reinterpret_cast<const GpuShadowView*>(given.views), given.view_count};
  lamp.depth_range = {given.depth_range[0], given.depth_range[1]};
  return lamp;
}

}  // namespace

extern "C" {

rebounce_status rebounce_gpu_engine_create(rebounce_transfer* transfer,
                                           rebounce_gl_get_proc_address get_proc_address,
                                           rebounce_gpu_engine** engine) {
  clear(engine);
  if (transfer == nullptr || get_proc_address == nullptr || engine == nullptr) {
    return missing("rebounce_gpu_engine_create");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    *engine = new rebounce_gpu_engine{GpuEngine(transfer->data, get_proc_address)};
    return REBOUNCE_OK;
  });
}

void rebounce_gpu_engine_destroy(rebounce_gpu_engine* engine) {
  delete engine;
}

uint64_t rebounce_gpu_engine_bytes(const rebounce_gpu_engine* engine) {
  return engine == nullptr ? 0 : engine->engine.bytes();
}

rebounce_status rebounce_gpu_engine_set_emitted_exitance(rebounce_gpu_engine* engine,
                                                         const float* emitted_exitance,
                                                         size_t patch_count) {
  if (engine == nullptr || emitted_exitance == nullptr) {
    return missing("rebounce_gpu_engine_set_emitted_exitance");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    const auto* const triples = reinterpret_cast<const Float3*>(emitted_exitance);
    engine->engine.set_emitted_exitance(std::span(triples, patch_count));
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_gpu_engine_set_sky(rebounce_gpu_engine* engine, const rebounce_sky* sky,
                                            const float* distribution) {
  if (engine == nullptr || sky == nullptr) return missing("rebounce_gpu_engine_set_sky");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    Sky taken{triple(sky->color), sky->luminance, nullptr};
    if (distribution != nullptr) {
      SkyDistribution cells;
      std::copy_n(distribution, cells.size(), cells.begin());
      taken.distribution = std::make_shared<const SkyDistribution>(cells);
    }
    engine->engine.set_sky(taken);
    return REBOUNCE_OK;
  });
}

void rebounce_gpu_lamp_init_sized(rebounce_gpu_lamp* lamp, uint32_t struct_size) {
  rebounce_gpu_lamp made{};
  std::ranges::copy(GpuLamp().depth_range, made.depth_range);
  init_sized(lamp, made, struct_size);
}

rebounce_status rebounce_gpu_engine_light_patches(rebounce_gpu_engine* engine,
                                                  const rebounce_gpu_lamp* lamps, size_t lamp_count,
                                                  uint32_t direct_irradiance, uint32_t others) {
  if (engine == nullptr || (lamps == nullptr && lamp_count > 0)) {
    return missing("rebounce_gpu_engine_light_patches");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    engine->lamps.clear();
    for (std::size_t k = 0; k < lamp_count; ++k) engine->lamps.push_back(gpu_lamp_at(lamps, k));
    engine->engine.light_patches(engine->lamps, direct_irradiance, others);
    return REBOUNCE_OK;
  });
}

void rebounce_gpu_buffers_init_sized(rebounce_gpu_buffers* buffers, uint32_t struct_size) {
  init_sized(buffers, rebounce_gpu_buffers{}, struct_size);
}

rebounce_status rebounce_gpu_engine_relight(rebounce_gpu_engine* engine,
                                            const rebounce_gpu_buffers* buffers) {
  if (engine == nullptr || buffers == nullptr) return missing("rebounce_gpu_engine_relight");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    rebounce_gpu_buffers none;
    rebounce_gpu_buffers_init(&none);
    const rebounce_gpu_buffers given =
        take(buffers, none, kGpuBuffersSize1, "rebounce_gpu_buffers_init");
    engine->engine.relight({.direct_irradiance = given.direct_irradiance,
                            .indirect_irradiance = given.indirect_irradiance,
                            .radiosity = given.radiosity,
                            .vertex_irradiance = given.vertex_irradiance,
                            .lightmap_irradiance = given.lightmap_irradiance,
                            .probe_light = given.probe_light});
    return REBOUNCE_OK;
  });
}

}  // extern "C"

}  // namespace rebounce::c
