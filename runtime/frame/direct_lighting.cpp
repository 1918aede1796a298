#include "runtime/frame/direct_lighting.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "runtime/frame/receivers.h"
#include "runtime/lights/lamp_shadows.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlock = Receivers::kBlock, kPart = Receivers::kPart;
constexpr std::size_t kAddedPerTask = 16;  // blocks per task where no light is traced
constexpr std::size_t kPointsAtOnce = 8;   // of each patch, found before their rays are traced

/// The light of a lamp without a surface at a block of points.
struct BlockLight {
  UnitLightBlock light;
  /// On the surfaces there, without shadow; not above 0 for light from below the horizon.
  PatchPointBlock::Coordinates arriving;

  void evaluate(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part) {
    lamp.evaluate(points, part, light);
    const auto &x = light.direction[0], &y = light.direction[1], &z = light.direction[2];
    const auto &normal_x = points.normal[0], &normal_y = points.normal[1],
               &normal_z = points.normal[2];
#pragma omp simd
    for (std::size_t e = part * kPart; e < (part + 1) * kPart; ++e) {
      const float cosine = x[e] * normal_x[e] + y[e] * normal_y[e] + z[e] * normal_z[e];
      arriving[e] = light.illuminance[e] * cosine;
    }
  }
};

/// The light of one lamp at the slots of one block.
struct LampAtBlock {
  const Receivers& receivers;
  const PreparedLight& lamp;
  std::size_t block;
  Receivers::Reached reached;

  /// Adds the light of a lamp without a surface.
  void add(LampShadows& shadows) const {
    const float share = 1 / static_cast<float>(receivers.points_per_patch);
    std::array<BlockLight, kPointsAtOnce> light;
    for (std::size_t first = 0; first < receivers.points_per_patch; first += kPointsAtOnce) {
      const std::size_t last = std::min(first + kPointsAtOnce, receivers.points_per_patch);
      for (std::size_t k = first; k < last; ++k) evaluate(k, light[k - first]);
      // Rays from the points of a patch take nearly the same way, so they follow each other.
      for_each_slot([&](std::size_t slot) {
        for (std::size_t k = first; k < last; ++k) {
          const auto& [here, arriving] = light[k - first];
          if (arriving[slot] <= 0) continue;
          shadows.add_ray(receivers.points(block, k).at(slot), here.at(slot),
                          share * arriving[slot], slot);
        }
      });
    }
  }

  /// Adds the light of a lamp with a surface.
  void add_surface(LampShadows& shadows) const {
    const float share = 1 / static_cast<float>(receivers.points_per_patch);
    const std::size_t samples = receivers.area_light_samples;
    const auto around = [](float x) { return x < 1 ? x : x - 1; };
    std::array<glm::vec2, kMaxAreaLightSamples> places;
    for_each_slot([&](std::size_t slot) {
      const glm::vec2& shift = receivers.shift[block * kBlock + slot];
      for (std::size_t k = 0; k < receivers.points_per_patch; ++k) {
        for (std::size_t j = 0; j < samples; ++j) {
          const glm::vec2 moved = receivers.places[k * samples + j] + shift;
          places[j] = {around(moved.x), around(moved.y)};
        }
        const PatchPointBlock& points = receivers.points(block, k);
        shadows.add_surface(lamp, {points.at(slot), points.normal_at(slot)},
                            std::span(places).first(samples), share, slot);
      }
    });
  }

 private:
  void evaluate(std::size_t k, BlockLight& light) const {
    for (std::size_t part = 0; part < reached.size(); ++part) {
      if (reached[part]) light.evaluate(lamp, receivers.points(block, k), part);
    }
  }

  template <typename Work>
  void for_each_slot(const Work& work) const {
    for (std::size_t slot = 0; slot < receivers.slots_in(block); ++slot) {
      if (reached[slot / kPart]) work(slot);
    }
  }
};

}  // namespace

/// The irradiance of one light at intensity 1.
struct DirectLighting::LightResponse {
  PreparedLight light;
  bool known = false;  ///< whether `irradiance` is that of `light`
  bool stale = false;  ///< whether this frame must trace it
  glm::vec3 intensity{0};
  std::vector<float> irradiance;  ///< [slots] per unit of intensity
  std::vector<std::uint8_t> lit;  ///< [blocks] 0: the irradiance of all slots in the block is 0
};

DirectLighting::DirectLighting(const TransferData& data, const RayTracer& tracer,
                               const DirectLightingSettings& settings)
    : data_(data), tracer_(tracer), receivers_(std::make_shared<const Receivers>(data, settings)) {
  make_room(static_cast<std::size_t>(std::max(0, settings.light_capacity)));
}

DirectLighting::~DirectLighting() = default;
DirectLighting::DirectLighting(const DirectLighting&) = default;

void DirectLighting::make_room(std::size_t light_count) {
  while (responses_.size() < light_count) {
    LightResponse& response = responses_.emplace_back();
    response.irradiance.resize(receivers_->size());
    response.lit.resize(receivers_->block_count());
  }
}

void DirectLighting::compute(std::span<const Light> lights, const Sky& sky,
                             std::span<Float3> direct_irradiance, const Scheduler& scheduler) {
  assert(direct_irradiance.size() == data_.patches.size());
  check_sky(sky, data_);
  prepare(lights);
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
      std::span(response.irradiance).subspan(block * kBlock, receivers_->slots_in(block));
  std::ranges::fill(irradiance, 0.0F);
  response.lit[block] = 0;
  const PreparedLight& light = response.light;
  const Receivers::Reached reached = receivers_->reached(block, light);
  if (std::ranges::find(reached, true) == reached.end()) return;

  const LampAtBlock here{*receivers_, light, block, reached};
  LampShadows shadows(tracer_, irradiance);
  if (light.has_area()) {
    here.add_surface(shadows);
  } else {
    here.add(shadows);
  }
  shadows.flush();
  response.lit[block] = std::ranges::any_of(irradiance, [](float e) { return e > 0; }) ? 1 : 0;
}

void DirectLighting::add_up(const Sky& sky, std::size_t block,
                            std::span<Float3> direct_irradiance) const {
  const std::size_t begin = block * kBlock, count = receivers_->slots_in(block);
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

}  // namespace rebounce
