// The C interface of rebounce.h: handles around the C++ classes, exceptions turned into statuses.

#include "rebounce.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "rebounce/outputs.h"
#include "rebounce/sky.h"
#include "rebounce/transfer_file.h"
#include "rebounce/version.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/sky_light.h"
#include "transfer/file/transfer_data.h"

using namespace rebounce;

// NOLINTBEGIN(readability-identifier-naming): the names of a C interface

struct rebounce_transfer {
  std::shared_ptr<const TransferData> data;
  std::atomic<int> references = 1;
};

struct rebounce_engine {
  Engine engine;
  std::vector<Light> lights;                                ///< of the current frame
  std::shared_ptr<const SkyDistribution> sky_distribution;  ///< may be null

  explicit rebounce_engine(Engine made) : engine(std::move(made)) {}
};

// NOLINTEND(readability-identifier-naming)

namespace {

static_assert(sizeof(Float3) == 3 * sizeof(float));
static_assert(REBOUNCE_SKY_CELL_COUNT == kSkyCellCount);
static_assert(REBOUNCE_PATCH_RECEIVER == PatchRoles::kReceiver);
static_assert(REBOUNCE_PATCH_SOURCE == PatchRoles::kSource);
static_assert(sizeof(SurfaceLight) == 12 * sizeof(float));
static_assert(sizeof(QuadraticProbeLight) == 27 * sizeof(float));
static_assert(sizeof(ProbeLight) == 54 * sizeof(float));

thread_local std::string last_error;

rebounce_status fail(rebounce_status status, const char* message) noexcept {
  try {
    last_error = message;
  } catch (...) {
    last_error.clear();  // no memory for the message
  }
  return status;
}

/// Runs `work`; an Error from it becomes `status`.
template <typename Work>
rebounce_status guarded(rebounce_status status, const Work& work) noexcept {
  try {
    return work();
  } catch (const Unsupported& error) {
    return fail(REBOUNCE_UNSUPPORTED, error.what());
  } catch (const Error& error) {
    return fail(status, error.what());
  } catch (const std::bad_alloc&) {
    return fail(REBOUNCE_OUT_OF_MEMORY, "out of memory; close something or use a smaller scene");
  } catch (const std::exception& error) {
    return fail(REBOUNCE_INTERNAL, error.what());
  } catch (...) {
    return fail(REBOUNCE_INTERNAL, "unknown exception");
  }
}

rebounce_status missing(const char* function) noexcept {
  return guarded(REBOUNCE_INTERNAL, [&]() -> rebounce_status {
    const std::string text = std::string(function) + ": an argument is NULL; give all of them";
    return fail(REBOUNCE_INVALID_ARGUMENT, text.c_str());
  });
}

const float* floats(std::span<const Float3> values) {
  return values.empty() ? nullptr : values.front().data();
}

Float3 triple(const float* values) {
  return {values[0], values[1], values[2]};
}

// Larger than the structures of any version. A larger size is memory that nobody initialised.
constexpr std::size_t kLargestStruct = 4096;

void check_struct_size(std::uint32_t size, std::size_t least_size) {
  if (size >= least_size && size <= kLargestStruct) return;
  throw Error("struct_size is " + std::to_string(size) +
              "; fill the structure with its _init function");
}

/// Copies the members that the caller's version of the structure has; the others keep `defaults`.
template <typename Struct>
Struct take(const Struct* given, Struct defaults, std::size_t least_size) {
  check_struct_size(given->struct_size, least_size);
  std::memcpy(&defaults, given, std::min<std::size_t>(given->struct_size, sizeof(Struct)));
  return defaults;
}

// Sizes of the structures in version 1 of the interface, up to their last member then. They stay
// the same when a structure grows: members that an older caller lacks get their defaults.
constexpr std::size_t kLightSize1 =
    offsetof(rebounce_light, tangent) + sizeof(rebounce_light::tangent);
constexpr std::size_t kSettingsSize1 = offsetof(rebounce_engine_settings, light_capacity) +
                                       sizeof(rebounce_engine_settings::light_capacity);
constexpr std::size_t kInfoSize1 = offsetof(rebounce_transfer_info, operator_bytes) +
                                   sizeof(rebounce_transfer_info::operator_bytes);
static_assert(kLightSize1 == 84 && kSettingsSize1 == 16 && kInfoSize1 == 48);

/// Reads light k of an array whose entries have the size that the caller states.
void take_light(const rebounce_light* lights, std::size_t k, Light& light) {
  rebounce_light defaults;
  rebounce_light_init(&defaults);
  check_struct_size(lights->struct_size, kLightSize1);
  const auto* const bytes = reinterpret_cast<const char*>(lights);
  const auto* const entry =
      reinterpret_cast<const rebounce_light*>(bytes + k * lights->struct_size);
  if (entry->struct_size != lights->struct_size) {
    throw Error("light " + std::to_string(k) + " has another struct_size than the first");
  }
  const rebounce_light given = take(entry, defaults, kLightSize1);
  if (given.type >= lamp_kinds().size()) {
    throw Error("light " + std::to_string(k) + " is of type " + std::to_string(given.type) +
                ", which there is not");
  }
  light.type = static_cast<LightType>(given.type);
  light.position = triple(given.position);
  light.direction = triple(given.direction);
  light.color = triple(given.color);
  light.intensity = given.intensity;
  light.range = given.range;
  light.inner_cone_angle = given.inner_cone_angle;
  light.outer_cone_angle = given.outer_cone_angle;
  light.radius = given.radius;
  light.size = {given.size[0], given.size[1]};
  light.tangent = triple(given.tangent);
}

Engine make_engine(const rebounce_transfer& transfer, const rebounce_engine_settings& settings) {
  const auto number = [](std::uint32_t given) {
    constexpr std::uint32_t kMost = 1U << 20U;
    return static_cast<int>(std::min(given, kMost));
  };
  return Engine(transfer.data,
                {.direct_lighting = {.points_per_patch = number(settings.points_per_patch),
                                     .area_light_samples = number(settings.area_light_samples),
                                     .light_capacity = number(settings.light_capacity)},
                 .scheduler = {settings.parallel_for, settings.user}});
}

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

uint32_t rebounce_abi_version(void) {
  return REBOUNCE_ABI_VERSION;
}

const char* rebounce_version(void) {
  return version();
}

const char* rebounce_last_error(void) {
  return last_error.c_str();
}

rebounce_status rebounce_transfer_load(const char* path, rebounce_transfer** transfer) {
  if (path == nullptr || transfer == nullptr) return missing("rebounce_transfer_load");
  *transfer = nullptr;
  return guarded(REBOUNCE_BAD_INPUT, [&] {
    const auto* const utf8 = reinterpret_cast<const char8_t*>(path);
    auto handle = std::make_unique<rebounce_transfer>();
    handle->data = load_transfer(std::filesystem::path(std::u8string(utf8)));
    *transfer = handle.release();
    return REBOUNCE_OK;
  });
}

void rebounce_transfer_retain(rebounce_transfer* transfer) {
  if (transfer != nullptr) transfer->references.fetch_add(1, std::memory_order_relaxed);
}

void rebounce_transfer_release(rebounce_transfer* transfer) {
  if (transfer == nullptr) return;
  if (transfer->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete transfer;
}

rebounce_status rebounce_transfer_get_info(const rebounce_transfer* transfer,
                                           rebounce_transfer_info* info) {
  if (transfer == nullptr || info == nullptr) return missing("rebounce_transfer_get_info");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    rebounce_transfer_info filled = take(info, *info, kInfoSize1);
    const TransferData& data = *transfer->data;
    filled.patch_count = static_cast<std::uint32_t>(data.patches.size());
    filled.vertex_count = static_cast<std::uint32_t>(data.mesh.position.size());
    filled.triangle_count = static_cast<std::uint32_t>(data.mesh.triangle.size());
    filled.material_count = static_cast<std::uint32_t>(data.materials.size());
    filled.probe_count = static_cast<std::uint32_t>(data.probes.size());
    std::ranges::copy(data.probes.grid, filled.probe_grid);
    filled.operator_bytes = data.transfer->bytes();
    filled.lightmap_width = data.lightmap.width;
    filled.lightmap_height = data.lightmap.height;
    std::memcpy(info, &filled, std::min<std::size_t>(info->struct_size, sizeof(filled)));
    return REBOUNCE_OK;
  });
}

const float* rebounce_transfer_patch_area(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->patches.area.data();
}
const float* rebounce_transfer_patch_centroid(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(transfer->data->patches.centroid);
}
const float* rebounce_transfer_patch_normal(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(transfer->data->patches.normal);
}
const float* rebounce_transfer_patch_reflectance(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(transfer->data->patches.reflectance);
}
const float* rebounce_transfer_vertex_position(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(transfer->data->mesh.position);
}
const float* rebounce_transfer_vertex_normal(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(transfer->data->mesh.normal);
}
const uint32_t* rebounce_transfer_triangle(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->mesh.triangle.empty()) return nullptr;
  return transfer->data->mesh.triangle.front().data();
}
const uint32_t* rebounce_transfer_triangle_patch(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->mesh.triangle_patch.data();
}
const uint8_t* rebounce_transfer_patch_role(const rebounce_transfer* transfer) {
  if (transfer == nullptr) return nullptr;
  const PatchRoles& roles = transfer->data->transfer->roles();
  return roles.all_are_both() ? nullptr : roles.role.data();
}
const float* rebounce_transfer_probe_position(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(transfer->data->probes.position);
}
const uint8_t* rebounce_transfer_probe_valid(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->probes.valid.data();
}

const float* rebounce_transfer_lightmap_texcoord(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->lightmap.empty()) return nullptr;
  return transfer->data->lightmap.texcoord.front().data();
}
const uint8_t* rebounce_transfer_lightmap_triangle(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->lightmap.empty()) return nullptr;
  return transfer->data->lightmap.has_texels.data();
}

void rebounce_light_init(rebounce_light* light) {
  if (light == nullptr) return;
  const Light defaults;
  *light = {};
  light->struct_size = sizeof(*light);
  light->type = REBOUNCE_LIGHT_POINT;
  std::ranges::copy(defaults.direction, light->direction);
  std::ranges::copy(defaults.color, light->color);
  light->intensity = defaults.intensity;
  light->outer_cone_angle = defaults.outer_cone_angle;
  std::ranges::copy(defaults.tangent, light->tangent);
}

void rebounce_engine_settings_init(rebounce_engine_settings* settings) {
  if (settings != nullptr) *settings = {sizeof(*settings), 8, 4, 16, nullptr, nullptr};
}

rebounce_status rebounce_engine_create(rebounce_transfer* transfer,
                                       const rebounce_engine_settings* settings,
                                       rebounce_engine** engine) {
  if (transfer == nullptr || engine == nullptr) return missing("rebounce_engine_create");
  *engine = nullptr;
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    rebounce_engine_settings chosen;
    rebounce_engine_settings_init(&chosen);
    if (settings != nullptr) chosen = take(settings, chosen, kSettingsSize1);
    auto handle = std::make_unique<rebounce_engine>(make_engine(*transfer, chosen));
    handle->lights.reserve(chosen.light_capacity);
    *engine = handle.release();
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_engine_clone(const rebounce_engine* engine, rebounce_engine** clone) {
  if (engine == nullptr || clone == nullptr) return missing("rebounce_engine_clone");
  *clone = nullptr;
  return guarded(REBOUNCE_INTERNAL, [&] {
    auto handle = std::make_unique<rebounce_engine>(*engine);
    handle->lights.reserve(engine->lights.capacity());
    *clone = handle.release();
    return REBOUNCE_OK;
  });
}

void rebounce_engine_destroy(rebounce_engine* engine) {
  delete engine;
}

rebounce_status rebounce_engine_relight(rebounce_engine* engine, const rebounce_light* lights,
                                        size_t light_count, const rebounce_sky* sky) {
  if (engine == nullptr || (lights == nullptr && light_count > 0)) {
    return missing("rebounce_engine_relight");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    engine->lights.resize(light_count);
    for (std::size_t k = 0; k < light_count; ++k) take_light(lights, k, engine->lights[k]);
    Sky taken;
    if (sky != nullptr) taken = {triple(sky->color), sky->luminance, engine->sky_distribution};
    engine->engine.relight(engine->lights, taken);
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_engine_relight_direct(rebounce_engine* engine, const float* irradiance,
                                               size_t patch_count) {
  if (engine == nullptr || irradiance == nullptr) {
    return missing("rebounce_engine_relight_direct");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    const auto* const triples = reinterpret_cast<const Float3*>(irradiance);
    engine->engine.relight(std::span(triples, patch_count));
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_engine_set_sky_distribution(rebounce_engine* engine,
                                                     const float* distribution) {
  if (engine == nullptr) return missing("rebounce_engine_set_sky_distribution");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    if (distribution == nullptr) {
      engine->sky_distribution = nullptr;
      return REBOUNCE_OK;
    }
    SkyDistribution taken;
    std::copy_n(distribution, taken.size(), taken.begin());
    auto shared = std::make_shared<const SkyDistribution>(taken);
    check_sky({.distribution = shared}, engine->engine.data());
    engine->sky_distribution = std::move(shared);
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_cie_sky(int type, const float* sun_direction, float ground_reflectance,
                                 float* distribution) {
  if (sun_direction == nullptr || distribution == nullptr) return missing("rebounce_cie_sky");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    std::ranges::copy(cie_sky(type, triple(sun_direction), ground_reflectance), distribution);
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_engine_set_emission_scale(rebounce_engine* engine, uint32_t material,
                                                   const float* scale) {
  if (engine == nullptr || scale == nullptr) return missing("rebounce_engine_set_emission_scale");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    engine->engine.set_emission_scale(material, triple(scale));
    return REBOUNCE_OK;
  });
}

const float* rebounce_engine_direct_irradiance(const rebounce_engine* engine) {
  return engine == nullptr ? nullptr : floats(engine->engine.direct_irradiance());
}
const float* rebounce_engine_indirect_irradiance(const rebounce_engine* engine) {
  return engine == nullptr ? nullptr : floats(engine->engine.indirect_irradiance());
}
const float* rebounce_engine_radiosity(const rebounce_engine* engine) {
  return engine == nullptr ? nullptr : floats(engine->engine.radiosity());
}

rebounce_status rebounce_engine_vertex_irradiance(const rebounce_engine* engine, float* irradiance,
                                                  size_t vertex_count) {
  return write_output<Float3>("rebounce_engine_vertex_irradiance", engine, irradiance, vertex_count,
                              vertex_irradiance);
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
