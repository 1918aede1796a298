// rebounce.h: lights, skies, engines and their frames.

#include <string>

#include "rebounce/sky.h"
#include "runtime/frame/c_handles.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/sky_light.h"

namespace rebounce::c {
namespace {

static_assert(REBOUNCE_SKY_CELL_COUNT == kSkyCellCount);

// Sizes of structures in version 1 of the interface, up to their last member then. They stay the
// same when a structure grows: members that an older caller lacks get their defaults.
constexpr std::size_t kLightSize1 =
    offsetof(rebounce_light, tangent) + sizeof(rebounce_light::tangent);
constexpr std::size_t kSettingsSize1 = offsetof(rebounce_engine_settings, light_capacity) +
                                       sizeof(rebounce_engine_settings::light_capacity);
static_assert(kLightSize1 == 84 && kSettingsSize1 == 16);

constexpr const char* kLightInit = "rebounce_light_init";

// Points, samples and lights that an engine is asked for.
constexpr std::uint32_t kMostAsked = 1U << 20U;

Engine make_engine(const rebounce_transfer& transfer, const rebounce_engine_settings& settings) {
  const auto number = [](std::uint32_t given) {
    return static_cast<int>(std::min(given, kMostAsked));
  };
  return Engine(transfer.data,
                {.direct_lighting = {.points_per_patch = number(settings.points_per_patch),
                                     .area_light_samples = number(settings.area_light_samples),
                                     .light_capacity = number(settings.light_capacity)},
                 .scheduler = {settings.parallel_for, settings.user}});
}

}  // namespace

void take_light(const rebounce_light* lights, std::size_t k, Light& light) {
  rebounce_light defaults;
  rebounce_light_init(&defaults);
  const std::uint32_t size = stated_size(lights);
  check_struct_size(size, kLightSize1, kLightInit);
  const char* const entry = reinterpret_cast<const char*>(lights) + k * size;
  if (stated_size(entry) != size) {
    throw Error("light " + std::to_string(k) +
                " has another struct_size than the first; fill it with " + kLightInit);
  }
  const rebounce_light given = take(entry, defaults, kLightSize1, kLightInit);
  if (given.type >= lamp_kinds().size()) {
    throw Error("light " + std::to_string(k) + " is of type " + std::to_string(given.type) +
                ", which does not exist; give one of rebounce_light_type");
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
  light.profile = given.profile == nullptr ? nullptr : given.profile->profile;
}

extern "C" {

void rebounce_light_init_sized(rebounce_light* light, uint32_t struct_size) {
  const Light defaults;
  rebounce_light made{};
  made.type = REBOUNCE_LIGHT_POINT;
  std::ranges::copy(defaults.direction, made.direction);
  std::ranges::copy(defaults.color, made.color);
  made.intensity = defaults.intensity;
  made.outer_cone_angle = defaults.outer_cone_angle;
  std::ranges::copy(defaults.tangent, made.tangent);
  init_sized(light, made, struct_size);
}

rebounce_status rebounce_ies_profile_parse(const char* text, size_t text_size, const char* name,
                                           rebounce_ies_profile** profile) {
  clear(profile);
  if (text == nullptr || name == nullptr || profile == nullptr) {
    return missing("rebounce_ies_profile_parse");
  }
  return guarded(REBOUNCE_BAD_INPUT, [&] {
    auto handle = std::make_unique<rebounce_ies_profile>();
    handle->profile = parse_ies_profile({text, text_size}, name);
    *profile = handle.release();
    return REBOUNCE_OK;
  });
}

void rebounce_ies_profile_destroy(rebounce_ies_profile* profile) {
  delete profile;
}

void rebounce_engine_settings_init_sized(rebounce_engine_settings* settings, uint32_t struct_size) {
  init_sized(settings, rebounce_engine_settings{struct_size, 8, 4, 16, nullptr, nullptr},
             struct_size);
}

rebounce_status rebounce_engine_create(rebounce_transfer* transfer,
                                       const rebounce_engine_settings* settings,
                                       rebounce_engine** engine) {
  clear(engine);
  if (transfer == nullptr || engine == nullptr) return missing("rebounce_engine_create");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    rebounce_engine_settings chosen;
    rebounce_engine_settings_init(&chosen);
    if (settings != nullptr)
      chosen = take(settings, chosen, kSettingsSize1, "rebounce_engine_settings_init");
    auto handle = std::make_unique<rebounce_engine>(make_engine(*transfer, chosen));
    handle->lights.reserve(std::min(chosen.light_capacity, kMostAsked));
    *engine = handle.release();
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_engine_clone(const rebounce_engine* engine, rebounce_engine** clone) {
  clear(clone);
  if (engine == nullptr || clone == nullptr) return missing("rebounce_engine_clone");
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
    const OneThread guard(engine->use);
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
    const OneThread guard(engine->use);
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

}  // extern "C"

}  // namespace rebounce::c
