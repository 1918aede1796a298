#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "runtime/demo/shading/display_surface.h"
#include "runtime/demo/shading/emitters.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// A surface point that a camera ray sees, and the light that arrives there.
struct CameraSample {
  std::uint32_t pixel = 0;  ///< y * width + x
  std::uint32_t index = 0;  ///< among the camera samples of its pixel
  float weight = 0;         ///< of the pixel's colour
  SurfacePoint point{};
  float footprint = 0;            ///< metres of surface between neighbouring samples
  glm::vec3 irradiance{0, 0, 0};  ///< lx
};

/// Adds the light of lamps, with shadows, to every sample's irradiance.
void add_punctual_light(std::span<CameraSample> samples, std::span<const Light> lights,
                        const RayTracer& tracer);

/// Adds the direct light of emitters, with shadows. Each camera sample of a pixel uses a share of
/// the emitters' pieces in place of all, so only the mean of the pixel is complete.
void add_emitter_light(std::span<CameraSample> samples, const Emitters& emitters,
                       const RayTracer& tracer, int samples_per_pixel);

}  // namespace rebounce
