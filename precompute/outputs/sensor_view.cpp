#include "precompute/outputs/sensor_view.h"

#include <algorithm>
#include <limits>
#include <map>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/patches/hit_patch.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "rebounce/error.h"
#include "rebounce/sky.h"
#include "runtime/lights/light_sampling.h"

namespace rebounce {
namespace {

/// What one point sees.
struct PointView {
  std::map<std::uint32_t, std::uint32_t> met;  ///< rays by patch
  std::array<float, kSkyCellCount> sky{};
};

class SensorViewer {
 public:
  SensorViewer(const DisplayMesh& mesh, const RayTracer& tracer, int ray_count)
      : mesh_(mesh),
        tracer_(tracer),
        rays_(static_cast<std::size_t>(ray_count)),
        hits_(rays_.size()) {}

  PointView look(const Float3& position, const Float3& normal, std::uint64_t number) {
    const PatchPoint point{position, normal};
    const PointSequence directions = r2_sequence(unit_square(mix_bits(number)));
    NormalFrame frame;
    for (std::uint32_t k = 0; k < rays_.size(); ++k) {
      rays_[k] =
          make_free_ray(point, frame.turn(normal, to_cosine_direction(directions[k])), tracer_);
    }
    tracer_.intersect(rays_, hits_);
    PointView view;
    for (std::size_t k = 0; k < rays_.size(); ++k) {
      prefer_lit_side(mesh_, tracer_, rays_[k], hits_[k], coincidence_);
      if (hits_[k].triangle == kNone) {
        view.sky[sky_cell(rays_[k].direction)] += 1 / static_cast<float>(rays_.size());
      } else if (const std::uint32_t patch = patch_at(mesh_, mesh_.triangle_patch, hits_[k]);
                 patch != kNone) {
        ++view.met[patch];
      }
    }
    return view;
  }

 private:
  const DisplayMesh& mesh_;
  const RayTracer& tracer_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  CoincidenceScratch coincidence_;
};

void check_sensors(std::span<const Float3> position, std::span<const Float3> normal) {
  if (position.size() != normal.size()) throw Error("sensors need as many normals as positions");
}

}  // namespace

SensorView view_of_sensors(const DisplayMesh& mesh, const RayTracer& tracer,
                           std::span<const Float3> position, std::span<const Float3> normal,
                           int ray_count, const Progress& progress) {
  check_sensors(position, normal);
  if (ray_count < 1) throw Error("sensors need at least one ray");
  std::vector<PointView> views(position.size());
  ParallelProgress loop(progress, position.size());
  parallel_loop(
      position.size(), 4, [&] { return SensorViewer(mesh, tracer, ray_count); },
      [&](std::size_t k, SensorViewer& viewer) {
        if (loop.stopped()) return;
        views[k] = viewer.look(position[k], normal[k], k);
        loop.advance();
      });
  loop.finish();
  SensorView result;
  for (const PointView& view : views) {
    for (const auto& [patch, count] : view.met) {
      result.patch.push_back(patch);
      result.part.push_back(static_cast<float>(count) / static_cast<float>(ray_count));
    }
    result.row_begin.push_back(result.patch.size());
    result.sky.push_back(view.sky);
  }
  return result;
}

void add_direct_irradiance(const RayTracer& tracer, const Light& light,
                           std::span<const Float3> position, std::span<const Float3> normal,
                           int samples, std::span<Float3> irradiance) {
  check_sensors(position, normal);
  if (irradiance.size() != position.size()) throw Error("irradiance has a wrong size");
  check_light(light);
  const int places = is_area_light(light.type) ? std::max(1, samples) : 1;
  std::vector<Ray> rays(static_cast<std::size_t>(places));
  std::vector<float> passed(rays.size());
  std::vector<Float3> arriving(rays.size());
  for (std::size_t k = 0; k < position.size(); ++k) {
    const PointSequence spread = r2_sequence(unit_square(mix_bits(k)));
    for (int s = 0; s < places; ++s) {
      const glm::dvec2 place = places > 1 ? spread[static_cast<std::uint32_t>(s)] : glm::dvec2(0.5);
      const IncidentLight incident = evaluate_light(
          light, position[k], {static_cast<float>(place.x), static_cast<float>(place.y)});
      const float cosine = glm::dot(to_glm(incident.direction), to_glm(normal[k]));
      rays[s] = {.origin = tracer.offset_point(position[k], normal[k]),
                 .t_near = 0,
                 .direction = incident.direction,
                 .t_far = shadow_ray_length(incident.distance)};
      for (int c = 0; c < kChannelCount; ++c) {
        arriving[s][c] =
            std::max(0.0F, cosine) * incident.illuminance[c] / static_cast<float>(places);
      }
    }
    tracer.transmittance(rays, PassageDetail::kMicroTriangle, passed);
    for (int s = 0; s < places; ++s) {
      for (int c = 0; c < kChannelCount; ++c) irradiance[k][c] += passed[s] * arriving[s][c];
    }
  }
}

}  // namespace rebounce
