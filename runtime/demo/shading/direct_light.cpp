#include "runtime/demo/shading/direct_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/demo/image/pixel_hash.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/polygon_form_factor.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// Shadow rays with the light that each carries, traced in batches.
class ShadowRays {
 public:
  void add(CameraSample& receiver, const Ray& ray, const glm::vec3& irradiance) {
    rays_.push_back(ray);
    arrivals_.push_back({&receiver, irradiance});
  }

  // Adds the light that arrives to its receivers, in the order of `add`, and removes all rays.
  void deliver(const RayTracer& tracer) {
    transmitted_.resize(rays_.size());
    tracer.transmittance(rays_, PassageDetail::kMicroTriangle, transmitted_);
    for (std::size_t k = 0; k < rays_.size(); ++k) {
      arrivals_[k].receiver->irradiance += transmitted_[k] * arrivals_[k].irradiance;
    }
    rays_.clear();
    arrivals_.clear();
  }

 private:
  struct Arrival {
    CameraSample* receiver;
    glm::vec3 irradiance;
  };
  std::vector<Ray> rays_;
  std::vector<float> transmitted_;
  std::vector<Arrival> arrivals_;
};

// The cosine at the receiver for light from `direction`; zero if it comes from below the triangle.
float receiving_cosine(const SurfacePoint& point, const glm::vec3& direction) {
  if (glm::dot(point.geometric_normal, direction) <= 0) return 0;
  return std::max(0.0F, glm::dot(point.shading_normal, direction));
}

Float3 above(const SurfacePoint& point, const RayTracer& tracer) {
  return tracer.offset_point(to_float3(point.position), to_float3(point.geometric_normal));
}

Ray ray_to_lamp(const PreparedLight& lamp, const UnitLight& light, const Float3& origin) {
  if (lamp.has_area() || !lamp.kind->has_place()) {
    return {.origin = origin,
            .t_near = 0,
            .direction = to_float3(light.direction),
            .t_far = shadow_ray_length(light.distance)};
  }
  return {.origin = origin,
          .t_near = 0,
          .direction = to_float3(lamp.position - to_glm(origin)),
          .t_far = 1};
}

// Sample points of a lamp with a surface per camera sample.
constexpr std::uint32_t kPlacesPerSample = 4;

// Sample point k of a camera sample; together the samples of a pixel cover the lamp evenly.
glm::vec2 place_on_lamp(const CameraSample& sample, std::uint32_t k) {
  return glm::vec2(r2_point(kPlacesPerSample * sample.index + k,
                            {hash_to_unit(sample.pixel, 5), hash_to_unit(sample.pixel, 6)}));
}

// What arrives at the sample from place k, or from a lamp without places.
UnitLight light_of(const PreparedLight& lamp, const CameraSample& sample, std::uint32_t k) {
  if (!lamp.has_area()) return lamp.evaluate(sample.point.position);
  const glm::vec2 place = place_on_lamp(sample, k);
  UnitLight light;
  lamp.evaluate_places(sample.point.position, {&place, 1}, {&light, 1});
  return light;
}

float form_factor(const SurfacePoint& receiver, const EmitterPiece& piece) {
  const glm::vec3 path = piece.centroid - receiver.position;
  const float distance_squared = glm::dot(path, path);
  // Beyond this distance the centre of a piece represents it with an error of about 0.2 %.
  constexpr float kFar = 32;
  if (distance_squared < kFar * piece.area) {
    return point_to_polygon_form_factor(receiver.position, receiver.shading_normal, piece.corner);
  }
  const float cosines = std::max(0.0F, glm::dot(receiver.shading_normal, path)) *
                        std::max(0.0F, -glm::dot(piece.normal, path));
  return cosines * piece.area / (std::numbers::pi_v<float> * distance_squared * distance_squared);
}

// The unshadowed irradiance from a piece.
glm::vec3 from_piece(const SurfacePoint& receiver, const EmitterPiece& piece) {
  const bool in_front = glm::dot(piece.normal, receiver.position - piece.centroid) > 0;
  if (!in_front) return glm::vec3(0);
  return std::numbers::pi_v<float> * piece.luminance * form_factor(receiver, piece);
}

// A uniform point of the piece, for `place` in the unit square.
glm::vec3 point_on(const EmitterPiece& piece, const glm::vec2& place) {
  const float root = std::sqrt(place.x);
  return (1 - root) * piece.corner[0] + root * (1 - place.y) * piece.corner[1] +
         root * place.y * piece.corner[2];
}

// A shadow ray to `target` on the piece; false if it starts or ends below a surface.
bool ray_to_piece(const SurfacePoint& receiver, const EmitterPiece& piece, const glm::vec3& target,
                  const RayTracer& tracer, Ray& ray) {
  ray.origin = above(receiver, tracer);
  const glm::vec3 end = to_glm(tracer.offset_point(to_float3(target), to_float3(piece.normal)));
  const glm::vec3 path = end - to_glm(ray.origin);
  ray.direction = to_float3(path);
  ray.t_near = 0;
  ray.t_far = 1;
  return glm::dot(path, receiver.geometric_normal) > 0 && glm::dot(path, piece.normal) < 0;
}

}  // namespace

void add_punctual_light(std::span<CameraSample> samples, std::span<const Light> lights,
                        const RayTracer& tracer) {
  ShadowRays shadow_rays;
  for (const Light& light : lights) {
    const PreparedLight lamp(light);
    const glm::vec3 intensity = to_glm(light.color) * light.intensity;
    const std::uint32_t places = lamp.has_area() ? kPlacesPerSample : 1;
    for (CameraSample& sample : samples) {
      for (std::uint32_t k = 0; k < places; ++k) {
        const UnitLight unit = light_of(lamp, sample, k);
        const float cosine = receiving_cosine(sample.point, unit.direction);
        const glm::vec3 arriving =
            intensity * unit.illuminance * (cosine / static_cast<float>(places));
        if (arriving == glm::vec3(0)) continue;
        shadow_rays.add(sample, ray_to_lamp(lamp, unit, above(sample.point, tracer)), arriving);
      }
    }
    shadow_rays.deliver(tracer);
  }
}

void add_emitter_light(std::span<CameraSample> samples, const Emitters& emitters,
                       const RayTracer& tracer, int samples_per_pixel) {
  const auto share = static_cast<std::uint32_t>(samples_per_pixel);
  ShadowRays shadow_rays;
  for (std::uint32_t first = 0; first < emitters.draw_count(); first += share) {
    for (CameraSample& sample : samples) {
      const std::uint32_t index = first + (sample.index + hash(sample.pixel)) % share;
      if (index >= emitters.draw_count()) continue;
      const auto [piece, weight] = emitters.draw(index, hash_to_unit(sample.pixel, 0));
      const glm::vec3 arriving = from_piece(sample.point, *piece);
      if (arriving == glm::vec3(0)) continue;
      // The irradiance is exact; visibility is tested at one point of the piece.
      const glm::vec2 place(
          r2_point(index, {hash_to_unit(sample.pixel, 1), hash_to_unit(sample.pixel, 2)}));
      Ray ray;
      if (!ray_to_piece(sample.point, *piece, point_on(*piece, place), tracer, ray)) {
        continue;
      }
      shadow_rays.add(sample, ray, arriving * (weight * static_cast<float>(samples_per_pixel)));
    }
    shadow_rays.deliver(tracer);
  }
}

}  // namespace rebounce
