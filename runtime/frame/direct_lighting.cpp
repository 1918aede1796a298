#include "runtime/frame/direct_lighting.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "rebounce/error.h"
#include "runtime/lights/lamp_shadows.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlock = 64;         // patches that a task lights
constexpr std::size_t kAddedPerTask = 16;  // blocks per task where no light is traced

/// Moves `places` of the unit square by `shift`, modulo 1.
void shift_places(std::span<const glm::vec2> places, const glm::vec2& shift,
                  std::span<glm::vec2> shifted) {
  const auto around = [](float x) { return x < 1 ? x : x - 1; };
  for (std::size_t k = 0; k < places.size(); ++k) {
    const glm::vec2 moved = places[k] + shift;
    shifted[k] = {around(moved.x), around(moved.y)};
  }
}

}  // namespace

/// The points that receive light: the same for every light and every frame.
struct DirectLighting::Receivers {
  std::size_t points_per_patch = 0;
  std::size_t area_light_samples = 0;
  /// [points_per_patch][area_light_samples] sample points, for every lamp.
  std::vector<glm::vec2> places;
  std::vector<LitPoint> points;  ///< [n][points_per_patch]
  std::vector<Box> block_box;    ///< [blocks] bounds of their points

  std::span<const LitPoint> points_of(std::size_t patch) const {
    return std::span(points).subspan(patch * points_per_patch, points_per_patch);
  }
};

/// The irradiance of one light at intensity 1.
struct DirectLighting::LightResponse {
  PreparedLight light;
  bool known = false;  ///< whether `irradiance` is that of `light`
  bool stale = false;  ///< whether this frame must trace it
  glm::vec3 intensity{0};
  std::vector<float> irradiance;  ///< [n] per unit of intensity
  std::vector<std::uint8_t> lit;  ///< [blocks] 0: the irradiance of all patches in the block is 0
};

DirectLighting::DirectLighting(const TransferData& data, const RayTracer& tracer,
                               const DirectLightingSettings& settings)
    : data_(data), tracer_(tracer), receivers_(spread_receivers(data, settings)) {
  make_room(static_cast<std::size_t>(std::max(0, settings.light_capacity)));
}

std::shared_ptr<const DirectLighting::Receivers> DirectLighting::spread_receivers(
    const TransferData& data, const DirectLightingSettings& settings) {
  const std::vector<ReceiverPoint> points = receiver_points(data, settings);
  if (settings.area_light_samples < 1 || settings.area_light_samples > kMaxAreaLightSamples) {
    throw Error("direct light needs from 1 to " + std::to_string(kMaxAreaLightSamples) +
                " samples of lamps with a surface");
  }
  auto receivers = std::make_shared<Receivers>();
  const auto points_per_patch = static_cast<std::size_t>(settings.points_per_patch);
  receivers->points_per_patch = points_per_patch;
  receivers->area_light_samples = static_cast<std::size_t>(settings.area_light_samples);
  receivers->places.resize(points_per_patch * receivers->area_light_samples);
  for (std::uint32_t k = 0; k < receivers->places.size(); ++k) {
    receivers->places[k] = glm::vec2(r2_point(k, {0, 0}));
  }
  receivers->block_box.resize((data.patches.size() + kBlock - 1) / kBlock);
  receivers->points.reserve(points.size());
  for (const auto& [position, normal] : points) {
    const std::size_t patch = receivers->points.size() / points_per_patch;
    receivers->points.push_back({to_glm(position), to_glm(normal)});
    receivers->block_box[patch / kBlock].add(to_glm(position));
  }
  return receivers;
}

DirectLighting::~DirectLighting() = default;
DirectLighting::DirectLighting(const DirectLighting&) = default;

void DirectLighting::make_room(std::size_t light_count) {
  while (responses_.size() < light_count) {
    LightResponse& response = responses_.emplace_back();
    response.irradiance.resize(data_.patches.size());
    response.lit.resize(receivers_->block_box.size());
  }
}

void DirectLighting::compute(std::span<const Light> lights, const Sky& sky,
                             std::span<Float3> direct_irradiance, const Scheduler& scheduler) {
  assert(direct_irradiance.size() == data_.patches.size());
  check_sky(sky, data_);
  prepare(lights);
  const std::size_t blocks_per_task = traced_light_count_ > 0 ? 1 : kAddedPerTask;
  const std::size_t block_count = receivers_->block_box.size();
  parallel_for_pieces(scheduler, block_count, blocks_per_task, [&](std::size_t block) {
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
  const std::size_t begin = block * kBlock,
                    end = std::min(begin + kBlock, response.irradiance.size());
  const std::span<float> irradiance(response.irradiance);
  std::ranges::fill(irradiance.subspan(begin, end - begin), 0.0F);
  const PreparedLight& light = response.light;
  const Box& box = receivers_->block_box[block];
  response.lit[block] = 0;
  if (box.distance_squared(light.position) >= light.reach_squared) return;

  const float weight = 1 / static_cast<float>(receivers_->points_per_patch);
  const std::size_t samples = receivers_->area_light_samples;
  std::array<glm::vec2, kMaxAreaLightSamples> places;
  LampShadows shadows(tracer_, irradiance);
  for (std::size_t patch = begin; patch < end; ++patch) {
    const std::span<const LitPoint> points = receivers_->points_of(patch);
    const glm::vec2 shift(unit_square(mix_bits(~static_cast<std::uint64_t>(patch))));
    for (std::size_t k = 0; k < points.size(); ++k) {
      const std::span<glm::vec2> here = std::span(places).first(light.has_area() ? samples : 0);
      shift_places(std::span(receivers_->places).subspan(k * samples, here.size()), shift, here);
      shadows.add(light, points[k], here, weight, patch);
    }
  }
  shadows.flush();
  const auto lit = [](float e) { return e > 0; };
  response.lit[block] = std::ranges::any_of(irradiance.subspan(begin, end - begin), lit) ? 1 : 0;
}

void DirectLighting::add_up(const Sky& sky, std::size_t block,
                            std::span<Float3> direct_irradiance) const {
  const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, data_.patches.size());
  for (std::size_t i = begin; i < end; ++i) direct_irradiance[i] = sky_irradiance(data_, sky, i);
  for (std::size_t k = 0; k < light_count_; ++k) {
    const LightResponse& response = responses_[k];
    const glm::vec3 intensity = response.intensity;
    if (intensity == glm::vec3(0) || response.lit[block] == 0) continue;
    for (std::size_t i = begin; i < end; ++i) {
      const float e = response.irradiance[i];
      Float3& sum = direct_irradiance[i];
      sum = {sum[0] + e * intensity.x, sum[1] + e * intensity.y, sum[2] + e * intensity.z};
    }
  }
}

}  // namespace rebounce
