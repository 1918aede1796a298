// What the page calls besides rebounce.h: a frame of lights in plain arrays, timed by stages.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "rebounce.h"
#include "runtime/frame/c_handles.h"
#include "runtime/lights/sky_model.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/float3_glm.h"

extern "C" {

/// The time in milliseconds, by the clock of the page.
[[clang::import_module("rebounce"), clang::import_name("now")]] double rebounce_web_now();

}  // extern "C"

namespace rebounce::c {
namespace {

/// A lamp as the page writes it: the fields of Light in their order, but name and profile.
struct PlainLight {
  float type;
  Float3 position, direction, color;
  float intensity, range, inner_cone_angle, outer_cone_angle, radius;
  Float2 size;
  Float3 tangent;
};
static_assert(sizeof(PlainLight) == 20 * sizeof(float));

void take_plain(const PlainLight& plain, Light& light) {
  light.type = static_cast<LightType>(plain.type);
  light.position = plain.position;
  light.direction = plain.direction;
  light.color = plain.color;
  light.intensity = plain.intensity;
  light.range = plain.range;
  light.inner_cone_angle = plain.inner_cone_angle;
  light.outer_cone_angle = plain.outer_cone_angle;
  light.radius = plain.radius;
  light.size = plain.size;
  light.tangent = plain.tangent;
}

/// Times the stages of a frame, one after the other.
class StageClock {
 public:
  explicit StageClock(double* milliseconds) : next_(milliseconds), begin_(rebounce_web_now()) {}
  void end_stage() {
    const double now = rebounce_web_now();
    *next_++ = now - begin_;
    begin_ = now;
  }

 private:
  double* next_;
  double begin_;
};

}  // namespace

extern "C" {

/// Relights as rebounce_engine_relight does; `sky` is colour and luminance. Writes the milliseconds
/// of direct light, product, and the sums before and after it.
[[clang::export_name("rebounce_web_relight")]] rebounce_status rebounce_web_relight(
    rebounce_engine* engine, const PlainLight* lights, std::size_t light_count,
    const std::array<float, 4>* sky, double* milliseconds) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    static std::vector<Light> taken;  // a frame that is refused leaves the engine's as they are
    taken.resize(light_count);
    for (std::size_t k = 0; k < light_count; ++k) take_plain(lights[k], taken[k]);
    check_lights(taken);
    const auto& [red, green, blue, luminance] = *sky;
    Engine::Parts& parts = engine->engine.parts();
    const OneThread guard(parts.use);
    StageClock clock(milliseconds);
    parts.compute_direct(taken, {{red, green, blue}, luminance, engine->sky_distribution});
    std::swap(engine->lights, taken);
    clock.end_stage();
    parts.compute_initial_exitance();
    clock.end_stage();
    parts.apply_transfer();
    clock.end_stage();
    parts.compute_radiosity();
    clock.end_stage();
    return REBOUNCE_OK;
  });
}

/// Writes at the vertices of the display mesh what arrives straight from the sky and from those
/// lights of the last frame that are `chosen`. Uses the light of patches [n] as workspace. To be
/// called once after each frame: the other lights are switched off here.
[[clang::export_name("rebounce_web_chosen_direct")]] rebounce_status rebounce_web_chosen_direct(
    rebounce_engine* engine, const std::uint8_t* chosen, Float3* patches, Float3* vertices) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    for (std::size_t k = 0; k < engine->lights.size(); ++k) {
      if (chosen[k] == 0) engine->lights[k].intensity = 0;
    }
    Engine::Parts& parts = engine->engine.parts();
    const OneThread guard(parts.use);
    const TransferData& data = *parts.data;
    const std::span<Float3> patch_light(patches, data.patches.size());
    parts.direct_lighting->compute(engine->lights, parts.sky, patch_light);
    light_at_vertices(data.mesh, patch_light, {vertices, data.mesh.position.size()});
    return REBOUNCE_OK;
  });
}

/// Writes what a sky of the CIE looks like, in parts of its luminance: [height][width], rows from
/// below up, columns from -x over +z and +x to -z. Below the horizon it is as bright as the cell 0
/// of rebounce_cie_sky.
[[clang::export_name("rebounce_web_sky_panorama")]] rebounce_status rebounce_web_sky_panorama(
    int type, const Float3* sun_direction, float ground, int width, int height, float* luminance) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    const CieSky sky(type, to_dvec3(*sun_direction));
    for (int row = 0; row < height; ++row) {
      const double altitude = ((row + 0.5) / height - 0.5) * std::numbers::pi;
      for (int column = 0; column < width; ++column) {
        const double around = (column + 0.5) / width * 2 * std::numbers::pi;
        const glm::dvec3 direction{-std::cos(altitude) * std::cos(around), std::sin(altitude),
                                   std::cos(altitude) * std::sin(around)};
        *luminance++ = altitude > 0 ? static_cast<float>(sky.luminance(direction)) : ground;
      }
    }
    return REBOUNCE_OK;
  });
}

}  // extern "C"

}  // namespace rebounce::c
