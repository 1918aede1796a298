#include "runtime/demo/bake/lit_surface.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "runtime/demo/image/tone_curve.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {

SurfaceLighter::SurfaceLighter(const TransferData& data, const RayTracer& tracer,
                               const PictureLight& light, int samples_per_piece,
                               int emitter_samples)
    : data_(data),
      tracer_(tracer),
      light_(light),
      samples_per_piece_(samples_per_piece),
      surface_(data),
      emitters_(data, surface_, emitter_samples),
      vertex_light_(light_at_vertices(data, light)) {}

std::vector<glm::vec3> SurfaceLighter::shown(std::uint32_t first, std::span<const LitPiece> pieces,
                                             std::span<const CameraSample> samples,
                                             float exposure_scale, bool textured) const {
  std::vector<glm::vec3> light = direct_irradiance(first, pieces.size(), samples);
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const auto& [point, width, added] = pieces[k];
    const glm::vec3 bounced = glm::max(
        interpolate(data_.mesh, vertex_light_.bounced, point) + to_glm(added), glm::vec3(0));
    const glm::vec3 irradiance =
        light[k] + interpolate(data_.mesh, vertex_light_.sky, point) + bounced;
    const glm::vec3 albedo =
        textured ? surface_.albedo(point, width) : surface_.untextured_albedo(point);
    light[k] = exposure_scale * albedo * irradiance * std::numbers::inv_pi_v<float> +
               dimmed(exposure_scale * surface_.emitted_luminance(point, width), kBrightestEmitter);
  }
  return light;
}

/// The samples that are not inside a body: the first surface above them is not a back face.
std::vector<CameraSample> SurfaceLighter::uncovered(std::span<const CameraSample> samples) const {
  std::vector<Ray> rays;
  for (const CameraSample& s : samples) {
    const Float3 normal = to_float3(s.point.geometric_normal);
    rays.push_back({.origin = tracer_.offset_point(to_float3(s.point.position), normal),
                    .t_near = 0,
                    .direction = normal,
                    .t_far = std::numeric_limits<float>::infinity()});
  }
  std::vector<Hit> hits(rays.size());
  tracer_.intersect(rays, hits);
  std::vector<CameraSample> kept;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (!is_culled(data_.mesh, hits[k])) kept.push_back(samples[k]);
  }
  return kept;
}

std::vector<glm::vec3> SurfaceLighter::direct_irradiance(
    std::uint32_t first, std::size_t piece_count, std::span<const CameraSample> samples) const {
  std::vector<CameraSample> open = uncovered(samples);
  add_punctual_light(open, light_.lights, tracer_);
  add_emitter_light(open, emitters_, tracer_, samples_per_piece_);
  std::vector<glm::vec3> mean(piece_count, glm::vec3(0));
  std::vector<int> count(piece_count, 0);
  for (const CameraSample& s : open) {
    mean[s.pixel - first] += s.irradiance;
    ++count[s.pixel - first];
  }
  for (std::size_t k = 0; k < piece_count; ++k) {
    mean[k] /= static_cast<float>(std::max(1, count[k]));
  }
  return mean;
}

}  // namespace rebounce
