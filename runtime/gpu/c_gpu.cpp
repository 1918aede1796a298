// rebounce.h: frames on the graphics card.

#include "rebounce/engine.h"
#include "runtime/frame/c_handles.h"

// NOLINTBEGIN(readability-identifier-naming): the names of a C interface

struct rebounce_gpu_engine {
  rebounce::GpuEngine engine;
};

// NOLINTEND(readability-identifier-naming)

namespace rebounce::c {
namespace {

// The size of the first version of the structure.
constexpr std::size_t kGpuBuffersSize1 =
    offsetof(rebounce_gpu_buffers, vertex_irradiance) + sizeof(std::uint32_t);

}  // namespace

extern "C" {

rebounce_status rebounce_gpu_engine_create(rebounce_transfer* transfer,
                                           rebounce_gl_get_proc_address get_proc_address,
                                           rebounce_gpu_engine** engine) {
  if (transfer == nullptr || get_proc_address == nullptr || engine == nullptr) {
    return missing("rebounce_gpu_engine_create");
  }
  *engine = nullptr;
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

void rebounce_gpu_buffers_init(rebounce_gpu_buffers* buffers) {
  if (buffers != nullptr) *buffers = {sizeof(*buffers), 0, 0, 0, 0};
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
                            .vertex_irradiance = given.vertex_irradiance});
    return REBOUNCE_OK;
  });
}

}  // extern "C"

}  // namespace rebounce::c
