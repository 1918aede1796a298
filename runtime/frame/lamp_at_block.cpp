#include "runtime/frame/lamp_at_block.h"

#include <algorithm>
#include <array>

#include "runtime/lights/lamp_shadows.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlock = Receivers::kBlock, kPart = Receivers::kPart;
constexpr std::size_t kPointsAtOnce = 8;  // of each patch, found before their shadows

// Groups of occluders before a block, and occluders before a part. Beyond this rays take less time.
constexpr std::size_t kMostGroups = 256, kMostOfPart = 64;
static_assert(kPart == kShadowLanes);

using Coordinates = PatchPointBlock::Coordinates;
using Depths = std::array<float, kPart>;
using Numbers = std::span<const ShadowVolumes::Number>;

/// The light of a lamp without a surface at a block of points.
struct BlockLight {
  UnitLightBlock light;
  /// On the surfaces there, without shadow; not above 0 for light from below the horizon.
  Coordinates arriving;

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

class LampAtBlock {
 public:
  LampAtBlock(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              std::size_t block, std::span<float> irradiance)
      : receivers_(receivers),
        lamp_(lamp),
        block_(block),
        share_(1 / static_cast<float>(receivers.points_per_patch)),
        irradiance_(irradiance),
        shadows_(tracer, irradiance),
        left_(receivers.reached(block, lamp)) {}

  void add(const ShadowVolumes* volumes) {
    if (!any_left()) return;
    if (volumes != nullptr) add_by_volumes(*volumes);
    if (any_left()) add_by_rays();
    shadows_.flush();
  }

 private:
  bool any_left() const { return std::ranges::find(left_, true) != left_.end(); }

  const Box& bounds(std::size_t part) const {
    return receivers_.bounds[block_ * left_.size() + part].box;
  }

  std::size_t slots_end(std::size_t part) const {
    return std::min(irradiance_.size(), (part + 1) * kPart);
  }

  /// Adds the light of the parts before which there are few occluders; others are left.
  void add_by_volumes(const ShadowVolumes& volumes) {
    using Between = ShadowVolumes::Between;
    Box box;
    for (std::size_t part = 0; part < left_.size(); ++part) {
      if (!left_[part]) continue;
      box.add(bounds(part).low);
      box.add(bounds(part).high);
    }
    std::array<ShadowVolumes::Number, kMostGroups> groups;
    std::array<ShadowVolumes::Number, kMostOfPart> numbers;
    std::size_t group_count = 0, count = 0;
    const Between near = volumes.groups_between(box, groups, group_count);
    if (near == Between::kHidden) left_.fill(false);
    if (near != Between::kSome) return;
    for (std::size_t part = 0; part < left_.size(); ++part) {
      if (!left_[part]) continue;
      const Between here =
          volumes.between(bounds(part), std::span(groups).first(group_count), numbers, count);
      if (here == Between::kMany) continue;
      left_[part] = here == Between::kSome &&
                    !add_part(volumes, std::span(numbers).first(count), part);
    }
  }

  /// Adds the light of a part that only `numbers` may hide. False if that takes rays.
  bool add_part(const ShadowVolumes& volumes, Numbers numbers, std::size_t part) {
    std::array<VolumePlanes, kMostOfPart> outer, inner;
    std::size_t certain = 0;
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      outer[k] = volumes.outer(numbers[k]);
      if (!volumes.is_certain(numbers[k])) continue;
      if (lamp_.has_area()) inner[certain] = volumes.inner(numbers[k]);
      ++certain;
    }
    const auto all = std::span<const VolumePlanes>(outer).first(numbers.size());
    if (lamp_.has_area()) {
      add_surface(all, std::span<const VolumePlanes>(inner).first(certain), part);
      return true;
    }
    if (certain < numbers.size()) return false;
    add_lit_points(all, part);
    return true;
  }

  /// How far point k of each slot of a part is in `volumes`. Returns the least.
  float depth_in(std::span<const VolumePlanes> volumes, std::size_t k, std::size_t part,
                 Depths& depth) const {
    const PatchPointBlock& points = receivers_.points(block_, k);
    return kernels_.points_in_volumes(volumes.data(), volumes.size(),
                                      points.position[0].data() + part * kPart, kBlock,
                                      depth.data());
  }

  /// Adds the light of a lamp without a surface at the points of a part that are in no shadow.
  void add_lit_points(std::span<const VolumePlanes> volumes, std::size_t part) {
    BlockLight light;
    const float share = share_;
    Depths depth, sum{};
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      if (depth_in(volumes, k, part, depth) >= 0) continue;
      light.evaluate(lamp_, receivers_.points(block_, k), part);
#pragma omp simd
      for (std::size_t e = 0; e < kPart; ++e) {
        const float arriving = light.arriving[part * kPart + e];
        const float free = depth[e] < 0 ? share : 0.0F;
        sum[e] += free * (arriving > 0 ? arriving : 0.0F);
      }
    }
    std::copy_n(sum.begin(), slots_end(part) - part * kPart, &irradiance_[part * kPart]);
  }

  /// Adds the light of a lamp with a surface to a part. Points outside of all `outer` volumes see
  /// the whole lamp, those in one of `inner` nothing of it; rays are for the others.
  void add_surface(std::span<const VolumePlanes> outer, std::span<const VolumePlanes> inner,
                   std::size_t part) {
    Depths partly, wholly;
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      if (depth_in(inner, k, part, wholly) >= 0) continue;
      depth_in(outer, k, part, partly);
      for (std::size_t slot = part * kPart; slot < slots_end(part); ++slot) {
        const std::size_t e = slot - part * kPart;
        if (wholly[e] >= 0) continue;
        if (partly[e] < 0) {
          const PatchPointBlock& points = receivers_.points(block_, k);
          irradiance_[slot] +=
              share_ * lamp_.unoccluded_irradiance(points.at(slot), points.normal_at(slot));
        } else {
          add_surface(k, slot);
        }
      }
    }
  }

  /// Adds the light of a lamp with a surface at one point, by rays.
  void add_surface(std::size_t k, std::size_t slot) {
    const std::size_t samples = receivers_.area_light_samples;
    const auto around = [](float x) { return x < 1 ? x : x - 1; };
    std::array<glm::vec2, kMaxAreaLightSamples> places;
    const glm::vec2& shift = receivers_.shift[block_ * kBlock + slot];
    for (std::size_t j = 0; j < samples; ++j) {
      const glm::vec2 moved = receivers_.places[k * samples + j] + shift;
      places[j] = {around(moved.x), around(moved.y)};
    }
    const PatchPointBlock& points = receivers_.points(block_, k);
    shadows_.add_surface(lamp_, {points.at(slot), points.normal_at(slot)},
                         std::span(places).first(samples), share_, slot);
  }

  /// Adds the light of all parts that are left.
  void add_by_rays() {
    if (!lamp_.has_area()) return add_points_by_rays();
    for_each_slot([&](std::size_t slot) {
      for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) add_surface(k, slot);
    });
  }

  void add_points_by_rays() {
    std::array<BlockLight, kPointsAtOnce> light;
    for (std::size_t first = 0; first < receivers_.points_per_patch; first += kPointsAtOnce) {
      const std::size_t last = std::min(first + kPointsAtOnce, receivers_.points_per_patch);
      for (std::size_t part = 0; part < left_.size(); ++part) {
        if (!left_[part]) continue;
        for (std::size_t k = first; k < last; ++k) {
          light[k - first].evaluate(lamp_, receivers_.points(block_, k), part);
        }
      }
      // Rays from the points of a patch take nearly the same way, so they follow each other.
      for_each_slot([&](std::size_t slot) {
        for (std::size_t k = first; k < last; ++k) {
          const auto& [here, arriving] = light[k - first];
          if (arriving[slot] <= 0) continue;
          shadows_.add_ray(receivers_.points(block_, k).at(slot), here.at(slot),
                           share_ * arriving[slot], slot);
        }
      });
    }
  }

  template <typename Work>
  void for_each_slot(const Work& work) const {
    for (std::size_t slot = 0; slot < irradiance_.size(); ++slot) {
      if (left_[slot / kPart]) work(slot);
    }
  }

  const Receivers& receivers_;
  const PreparedLight& lamp_;
  const ShadowKernels& kernels_ = shadow_kernels();
  std::size_t block_;
  float share_;  ///< of each point of a patch
  std::span<float> irradiance_;
  LampShadows shadows_;
  Receivers::Reached left_;  ///< parts whose light is still to be added
};

}  // namespace

void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const ShadowVolumes* volumes, std::size_t block, std::span<float> irradiance) {
  LampAtBlock(receivers, tracer, lamp, block, irradiance).add(volumes);
}

}  // namespace rebounce
