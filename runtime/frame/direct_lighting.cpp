#include "runtime/frame/direct_lighting.h"

#include <algorithm>
#include <cassert>

#include "runtime/frame/lamp_at_block.h"
#include "runtime/frame/receivers.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/occluders.h"

namespace rebounce {
namespace {

constexpr std::size_t kAddedPerTask = 16;  // blocks per task where no light is traced
// Planes of a scene whose shadow volumes are all compared with, and those of a scene that has more.
constexpr std::size_t kWholeScene = 1024, kLargestPlanes = 64;  // lab/091

}  // namespace

/// The irradiance of one light at intensity 1.
struct DirectLighting::LightResponse {
  LightResponse(std::size_t slot_count, std::size_t block_count, std::size_t group_count)
      : irradiance(slot_count), lit(block_count), volumes(group_count) {}

  PreparedLight light;
  bool known = false;  ///< whether `irradiance` is that of `light`
  bool stale = false;  ///< whether this frame must trace it
  glm::vec3 intensity{0};
  std::vector<float> irradiance;  ///< [slots] per unit of intensity
  std::vector<std::uint8_t> lit;  ///< [blocks] 0: the irradiance of all slots in the block is 0
  ShadowVolumes volumes;          ///< of `light`, in a frame that traces it
};

DirectLighting::DirectLighting(const TransferData& data, const RayTracer& tracer,
                               const DirectLightingSettings& settings, ShadowMethod method)
    : data_(data),
      tracer_(tracer),
      receivers_(std::make_shared<const Receivers>(data, settings)),
      occluders_(std::make_shared<const OccluderGroups>(
          method == ShadowMethod::kVolumes ? find_occluders(data.mesh, kWholeScene, kLargestPlanes)
                                           : Occluders{.piece = {}, .is_whole = false})) {
  make_room(static_cast<std::size_t>(std::max(0, settings.light_capacity)));
}

DirectLighting::~DirectLighting() = default;
DirectLighting::DirectLighting(const DirectLighting&) = default;

void DirectLighting::make_room(std::size_t light_count) {
  while (responses_.size() < light_count) {
    responses_.emplace_back(receivers_->size(), receivers_->block_count(),
                            occluders_->group.size());
  }
}

void DirectLighting::compute(std::span<const Light> lights, const Sky& sky,
                             std::span<Float3> direct_irradiance, const Scheduler& scheduler) {
  assert(direct_irradiance.size() == data_.patches.size());
  check_sky(sky, data_);
  prepare(lights);
  if (traced_light_count_ > 0) {
    parallel_for(scheduler, light_count_, [&](std::size_t k) {
      LightResponse& response = responses_[k];
      if (response.stale) {
        response.volumes.set(response.light, occluders_->group, tracer_.offset_distance());
      }
    });
  }
  const std::size_t blocks_per_task = traced_light_count_ > 0 ? 1 : kAddedPerTask;
  parallel_for_pieces(scheduler, receivers_->block_count(), blocks_per_task,
                      [&](std::size_t block) {
                        for (std::size_t k = 0; k < light_count_; ++k) {
                          if (responses_[k].stale) respond(responses_[k], block);
                        }
                        add_up(sky, block, direct_irradiance);
                      });
}

void DirectLighting::prepare(std::span<const Light> lights) {
  make_room(lights.size());
  light_count_ = lights.size();
  traced_light_count_ = 0;
  for (std::size_t k = 0; k < light_count_; ++k) {
    LightResponse& response = responses_[k];
    response.intensity = to_glm(lights[k].color) * lights[k].intensity;
    response.stale = false;
    if (response.intensity == glm::vec3(0)) continue;  // switched off: keep its irradiance
    const PreparedLight light(lights[k]);
    response.stale = !response.known || !(response.light == light);
    if (!response.stale) continue;
    response.light = light;
    response.known = true;
    ++traced_light_count_;
  }
}

void DirectLighting::respond(LightResponse& response, std::size_t block) const {
  const std::span<float> irradiance =
      std::span(response.irradiance)
          .subspan(block * Receivers::kBlock, receivers_->slots_in(block));
  std::ranges::fill(irradiance, 0.0F);
  response.lit[block] = 0;
  add_lamp(*receivers_, tracer_, response.light, *occluders_, response.volumes, block, irradiance);
  response.lit[block] = std::ranges::any_of(irradiance, [](float e) { return e > 0; }) ? 1 : 0;
}

void DirectLighting::add_up(const Sky& sky, std::size_t block,
                            std::span<Float3> direct_irradiance) const {
  const std::size_t begin = block * Receivers::kBlock, count = receivers_->slots_in(block);
  const std::span<const std::uint32_t> patch = std::span(receivers_->patch).subspan(begin, count);
  for (const std::uint32_t i : patch) direct_irradiance[i] = sky_irradiance(data_, sky, i);
  for (const LightResponse& response : std::span(responses_).first(light_count_)) {
    const glm::vec3 intensity = response.intensity;
    if (intensity == glm::vec3(0) || response.lit[block] == 0) continue;
    for (std::size_t k = 0; k < count; ++k) {
      const float e = response.irradiance[begin + k];
      Float3& sum = direct_irradiance[patch[k]];
      sum = {sum[0] + e * intensity.x, sum[1] + e * intensity.y, sum[2] + e * intensity.z};
    }
  }
}

std::size_t DirectLighting::strongest_light(std::size_t patch) const {
  const auto slot = std::ranges::find(receivers_->patch, patch) - receivers_->patch.begin();
  const auto given = [&](const LightResponse& response) {
    const glm::vec3 intensity = response.intensity;
    const float most = std::max({intensity.x, intensity.y, intensity.z});
    return most > 0 ? most * response.irradiance[static_cast<std::size_t>(slot)] : 0;
  };
  const auto lights = std::span(responses_).first(light_count_);
  return static_cast<std::size_t>(std::ranges::max_element(lights, {}, given) - lights.begin());
}

}  // namespace rebounce
