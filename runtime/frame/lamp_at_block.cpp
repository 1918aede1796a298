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
        reached_(receivers.reached(block, lamp)) {}

  void add(const ShadowVolumes* volumes) {
    if (std::ranges::find(reached_, true) == reached_.end()) return;
    std::array<Shade, kBlock> shade;
    shade.fill(Shade::kPartly);
    for (std::size_t slot = 0; slot < kBlock; ++slot) {
      if (!reached_[slot / kPart]) shade[slot] = Shade::kHidden;
    }
    if (volumes != nullptr) add_volumes(*volumes, shade);
    if (lamp_.has_area()) {
      add_surface(shade);
    } else {
      add_points(shade);
    }
    shadows_.flush();
  }

 private:
  enum class Shade : std::uint8_t { kFree, kPartly, kHidden };

  /// Adds what needs no ray, and tells what is left.
  void add_volumes(const ShadowVolumes& volumes, std::array<Shade, kBlock>& shade) {
    using Between = ShadowVolumes::Between;
    Box box;
    for (std::size_t part = 0; part < reached_.size(); ++part) {
      if (!reached_[part]) continue;
      box.add(bounds(part).low);
      box.add(bounds(part).high);
    }
    std::array<ShadowVolumes::Number, kMostGroups> groups;
    std::array<ShadowVolumes::Number, kMostOfPart> numbers;
    std::size_t group_count = 0, count = 0;
    const Between near = volumes.groups_between(box, groups, group_count);
    if (near == Between::kHidden) shade.fill(Shade::kHidden);
    if (near != Between::kSome) return;
    for (std::size_t part = 0; part < reached_.size(); ++part) {
      if (!reached_[part]) continue;
      const Between here =
          volumes.between(bounds(part), std::span(groups).first(group_count), numbers, count);
      const auto slots = std::span(shade).subspan(part * kPart, kPart);
      if (here == Between::kHidden) std::ranges::fill(slots, Shade::kHidden);
      if (here == Between::kSome) settle(volumes, std::span(numbers).first(count), part, slots);
    }
  }

  const Box& bounds(std::size_t part) const {
    return receivers_.bounds[block_ * reached_.size() + part].box;
  }

  /// Settles the slots of a part that only `numbers` may hide, as far as volumes do.
  void settle(const ShadowVolumes& volumes, Numbers numbers, std::size_t part,
              std::span<Shade> shade) {
    std::array<VolumePlanes, kMostOfPart> planes;
    for (std::size_t k = 0; k < numbers.size(); ++k) planes[k] = volumes.outer(numbers[k]);
    const auto outer = std::span<const VolumePlanes>(planes).first(numbers.size());
    const auto certain = [&](ShadowVolumes::Number k) { return volumes.is_certain(k); };
    if (lamp_.has_area()) {
      look_for_free(outer, part, shade);
      std::size_t count = 0;
      for (const ShadowVolumes::Number number : numbers) {
        if (certain(number)) planes[count++] = volumes.inner(number);
      }
      look_for_hidden(outer.first(count), part, shade);
    } else if (std::ranges::all_of(numbers, certain)) {
      add_lit_points(outer, part);
      std::ranges::fill(shade, Shade::kHidden);
    }
  }

  /// Adds the light of a lamp without a surface at the points of a part that are in no shadow.
  void add_lit_points(std::span<const VolumePlanes> volumes, std::size_t part) {
    BlockLight light;
    const float share = share_;
    std::array<float, kPart> sum{};
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      const PatchPointBlock& points = receivers_.points(block_, k);
      std::array<float, kPart> depth;
      const float least = kernels_.points_in_volumes(
          volumes.data(), volumes.size(), points.position[0].data() + part * kPart, kBlock,
          depth.data());
      if (least >= 0) continue;
      light.evaluate(lamp_, points, part);
#pragma omp simd
      for (std::size_t e = 0; e < kPart; ++e) {
        const float arriving = light.arriving[part * kPart + e];
        const float free = depth[e] < 0 ? share : 0.0F;
        sum[e] += free * (arriving > 0 ? arriving : 0.0F);
      }
    }
    const auto slots = irradiance_.subspan(part * kPart);
    std::copy_n(sum.begin(), std::min(kPart, slots.size()), slots.begin());
  }

  /// Finds the slots of a part from which the whole of a lamp with a surface is seen.
  void look_for_free(std::span<const VolumePlanes> outer, std::size_t part,
                     std::span<Shade> shade) const {
    std::array<float, kPart> depth;
    kernels_.boxes_in_volumes(outer.data(), outer.size(), slot_boxes(part), 1, depth.data());
    for (std::size_t e = 0; e < kPart; ++e) {
      if (depth[e] < 0) shade[e] = Shade::kFree;
    }
  }

  /// Finds those from which nothing of it is seen.
  void look_for_hidden(std::span<const VolumePlanes> inner, std::size_t part,
                       std::span<Shade> shade) const {
    std::array<float, kPart> depth;
    kernels_.boxes_in_volumes(inner.data(), inner.size(), slot_boxes(part), -1, depth.data());
    for (std::size_t e = 0; e < kPart; ++e) {
      if (depth[e] > 0) shade[e] = Shade::kHidden;
    }
  }

  BoxLanes slot_boxes(std::size_t part) const {
    const Receivers::SlotBoxes& boxes = receivers_.boxes[block_];
    const auto of_part = [&](const auto& vectors) { return vectors[0].data() + part * kPart; };
    return {.middle = of_part(boxes.middle),
            .side = {of_part(boxes.side[0]), of_part(boxes.side[1]), of_part(boxes.side[2])},
            .stride = kBlock};
  }

  /// Adds the light of a lamp without a surface, by rays.
  void add_points(const std::array<Shade, kBlock>& shade) {
    std::array<BlockLight, kPointsAtOnce> light;
    for (std::size_t first = 0; first < receivers_.points_per_patch; first += kPointsAtOnce) {
      const std::size_t last = std::min(first + kPointsAtOnce, receivers_.points_per_patch);
      for (std::size_t part = 0; part < reached_.size(); ++part) {
        if (shade[part * kPart] == Shade::kHidden) continue;
        for (std::size_t k = first; k < last; ++k) {
          light[k - first].evaluate(lamp_, receivers_.points(block_, k), part);
        }
      }
      // Rays from the points of a patch take nearly the same way, so they follow each other.
      for (std::size_t slot = 0; slot < irradiance_.size(); ++slot) {
        if (shade[slot] == Shade::kHidden) continue;
        for (std::size_t k = first; k < last; ++k) {
          const auto& [here, arriving] = light[k - first];
          if (arriving[slot] <= 0) continue;
          shadows_.add_ray(receivers_.points(block_, k).at(slot), here.at(slot),
                           share_ * arriving[slot], slot);
        }
      }
    }
  }

  /// Adds the light of a lamp with a surface.
  void add_surface(const std::array<Shade, kBlock>& shade) {
    const std::size_t samples = receivers_.area_light_samples;
    const auto around = [](float x) { return x < 1 ? x : x - 1; };
    std::array<glm::vec2, kMaxAreaLightSamples> places;
    for (std::size_t slot = 0; slot < irradiance_.size(); ++slot) {
      if (shade[slot] == Shade::kHidden) continue;
      const glm::vec2& shift = receivers_.shift[block_ * kBlock + slot];
      for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
        const PatchPointBlock& points = receivers_.points(block_, k);
        const LitPoint point{points.at(slot), points.normal_at(slot)};
        if (shade[slot] == Shade::kFree) {
          irradiance_[slot] += share_ * lamp_.unoccluded_irradiance(point.position, point.normal);
          continue;
        }
        for (std::size_t j = 0; j < samples; ++j) {
          const glm::vec2 moved = receivers_.places[k * samples + j] + shift;
          places[j] = {around(moved.x), around(moved.y)};
        }
        shadows_.add_surface(lamp_, point, std::span(places).first(samples), share_, slot);
      }
    }
  }

  const Receivers& receivers_;
  const PreparedLight& lamp_;
  const ShadowKernels& kernels_ = shadow_kernels();
  std::size_t block_;
  float share_;  ///< of each point of a patch
  std::span<float> irradiance_;
  LampShadows shadows_;
  Receivers::Reached reached_;
};

}  // namespace

void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const ShadowVolumes* volumes, std::size_t block, std::span<float> irradiance) {
  LampAtBlock(receivers, tracer, lamp, block, irradiance).add(volumes);
}

}  // namespace rebounce
