#include "bench/frame/direct_cases.h"

#include <algorithm>
#include <array>

#include "bench/support/light_changes.h"
#include "precompute/lights/random_lights.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/box.h"
#include "runtime/rays/sampling.h"
#include "transfer/base/area_norm.h"

namespace rebounce::bench {
namespace {

constexpr std::array<std::size_t, 3> kMovedCounts = {1, 4, 16};
constexpr std::size_t kJudges = 64;  // lamps that errors are taken over
constexpr std::size_t kBareRayCount = 16384;
constexpr std::uint64_t kSeed = 7;

}  // namespace

DirectCases::DirectCases(const TransferData& data, const RayTracer& tracer)
    : data_(data),
      tracer_(tracer),
      fast_(data, tracer),
      traced_(data, tracer, {}, ShadowMethod::kRays),
      irradiance_(data.patches.size()),
      reference_(data.patches.size()) {
  for (const LightType type : kLampTypes) {
    const DirectErrors of_type = errors(type);
    for (const std::size_t count : kMovedCounts) {
      rows_.push_back(
          {"direct, " + std::string(lamp_kind(type).plural) + " moved", count, of_type});
    }
  }
}

/// Lamps in the free space of the scene. What shines one way only shines towards some patch.
std::vector<Light> DirectCases::lamps(LightType type, std::size_t count) const {
  const double diagonal = box_around(data_.mesh.position).diagonal();
  std::vector<Light> lamps = random_point_lights(data_, tracer_, static_cast<int>(count), kSeed);
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    const Float3& target = data_.patches.centroid[mix_bits(k) % data_.patches.size()];
    lamps[k] = lamp_of_type(type, lamps[k], target, diagonal);
  }
  return lamps;
}

DirectErrors DirectCases::errors(LightType type) {
  DirectErrors errors;
  int counted = 0;
  for (const Light& lamp : lamps(type, kJudges)) {
    fast_.compute({&lamp, 1}, {}, irradiance_);
    traced_.compute({&lamp, 1}, {}, reference_);
    const double error = relative_difference(irradiance_, reference_, data_.patches.area);
    if (error == 0 && area_norm(reference_, data_.patches.area) == 0) continue;
    ++counted;
    errors.mean += error;
    errors.largest = std::max(errors.largest, error);
  }
  errors.mean /= counted;
  return errors;
}

void DirectCases::add_to(std::vector<TimedCase>& cases) {
  for (const LightType type : kLampTypes) {
    for (const std::size_t count : kMovedCounts) {
      // Every run ends with the second half, where light k is lamp count + k. It begins with the
      // first, where light k is lamp k: they have all moved, whichever case ran before.
      const auto all = std::make_shared<const std::vector<Light>>(lamps(type, 2 * count));
      for (DirectLighting* direct : {&fast_, &traced_}) {
        cases.push_back({.work = [this, all, direct, count] {
          for (const std::size_t half : {0, 1}) {
            direct->compute(std::span(*all).subspan(half * count, count), {}, irradiance_);
          }
        }});
      }
    }
  }
}

TimedCase bare_rays(const TransferData& data, const RayTracer& tracer) {
  const Float3 lamp = random_point_lights(data, tracer, 1, kSeed).front().position;
  const auto rays = std::make_shared<std::vector<Ray>>(kBareRayCount);
  for (std::size_t k = 0; k < kBareRayCount; ++k) {
    const std::size_t patch = k * data.patches.size() / kBareRayCount;
    Ray& ray = (*rays)[k];
    ray.origin = tracer.offset_point(data.patches.centroid[patch], data.patches.normal[patch]);
    ray.t_near = 0;
    for (int c = 0; c < 3; ++c) ray.direction[c] = lamp[c] - ray.origin[c];
  }
  return {.work = [&tracer, rays] {
    for (Ray& ray : *rays) ray.t_far = 1;
    tracer.occluded(*rays);
  }};
}

}  // namespace rebounce::bench
