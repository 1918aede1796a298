#include "runtime/frame/lamp_at_block.h"

#include <algorithm>
#include <array>
#include <limits>

#include "runtime/lights/lamp_shadows.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlock = Receivers::kBlock, kPart = Receivers::kPart;
constexpr std::size_t kPointsAtOnce = 8;  // of each patch, found before their shadows

// Of a block and of a part of it. Beyond this rays take less time.
constexpr std::size_t kMostOfBlock = 256, kMostOfPart = 48;

using Coordinates = PatchPointBlock::Coordinates;
using OfPart = std::array<float, kPart>;
using Numbers = std::span<const ShadowVolumes::Number>;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

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

/// Lowers `least` to how far points are on the inner side of `plane`.
void lower(const ShadowVolumes::Plane& plane, const std::array<Coordinates, 3>& position,
           std::size_t part, OfPart& least) {
  const auto &x = position[0], &y = position[1], &z = position[2];
  const glm::vec3 n = plane.normal;
  const float distance = plane.distance;
#pragma omp simd
  for (std::size_t e = 0; e < kPart; ++e) {
    const std::size_t at = part * kPart + e;
    least[e] = std::min(least[e], n.x * x[at] + n.y * y[at] + n.z * z[at] - distance);
  }
}

/// The same for the boxes of slots: `sign` 1 for their innermost corner, -1 for their outermost.
void lower(const ShadowVolumes::Plane& plane, float sign, const Receivers::SlotBoxes& boxes,
           std::size_t part, OfPart& least) {
  const auto &x = boxes.middle[0], &y = boxes.middle[1], &z = boxes.middle[2];
  const auto &half_x = boxes.half[0], &half_y = boxes.half[1], &half_z = boxes.half[2];
  const glm::vec3 n = plane.normal, m = sign * glm::abs(n);
  const float distance = plane.distance;
#pragma omp simd
  for (std::size_t e = 0; e < kPart; ++e) {
    const std::size_t at = part * kPart + e;
    const float middle = n.x * x[at] + n.y * y[at] + n.z * z[at] - distance;
    least[e] = std::min(least[e], middle + m.x * half_x[at] + m.y * half_y[at] + m.z * half_z[at]);
  }
}

void raise(OfPart& most, const OfPart& to) {
#pragma omp simd
  for (std::size_t e = 0; e < kPart; ++e) most[e] = std::max(most[e], to[e]);
}

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
    Box box;
    for (std::size_t part = 0; part < reached_.size(); ++part) {
      if (!reached_[part]) continue;
      box.add(bounds(part).low);
      box.add(bounds(part).high);
    }
    std::array<ShadowVolumes::Number, kMostOfBlock> of_block;
    const ShadowVolumes::Between near = volumes.between(box, of_block);
    if (!near.all) return;
    for (std::size_t part = 0; part < reached_.size(); ++part) {
      if (!reached_[part]) continue;
      std::array<ShadowVolumes::Number, kMostOfPart> of_part;
      const ShadowVolumes::Between here =
          near.hidden ? near : volumes.between(bounds(part), near.number, of_part);
      const auto slots = std::span(shade).subspan(part * kPart, kPart);
      if (here.hidden) {
        std::ranges::fill(slots, Shade::kHidden);
      } else if (here.all && lamp_.has_area()) {
        look(volumes, here.number, part, slots);
      } else if (here.all && std::ranges::all_of(here.number, [&](ShadowVolumes::Number number) {
                   return volumes.is_certain(number);
                 })) {
        add_lit_points(volumes, here.number, part);
        std::ranges::fill(slots, Shade::kHidden);
      }
    }
  }

  const Box& bounds(std::size_t part) const {
    return receivers_.bounds[block_ * reached_.size() + part].box;
  }

  /// Adds the light of a lamp without a surface at the points of a part that are in no shadow.
  void add_lit_points(const ShadowVolumes& volumes, Numbers numbers, std::size_t part) {
    BlockLight light;
    const std::size_t slots = std::min(kPart, irradiance_.size() - part * kPart);
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      const PatchPointBlock& points = receivers_.points(block_, k);
      light.evaluate(lamp_, points, part);
      OfPart depth;  // in the shadow of any
      depth.fill(-kInfinity);
      for (const ShadowVolumes::Number number : numbers) {
        OfPart least;
        least.fill(kInfinity);
        for (const ShadowVolumes::Plane& plane : volumes.outer(number)) {
          lower(plane, points.position, part, least);
        }
        raise(depth, least);
      }
      for (std::size_t e = 0; e < slots; ++e) {
        const float arriving = light.arriving[part * kPart + e];
        if (arriving > 0 && depth[e] < 0) irradiance_[part * kPart + e] += share_ * arriving;
      }
    }
  }

  /// Which slots of a part see a whole lamp with a surface, and which see nothing of it.
  void look(const ShadowVolumes& volumes, Numbers numbers, std::size_t part,
            std::span<Shade> shade) const {
    constexpr std::size_t kOwnPlane = ShadowVolumes::kPlanes - 1;
    OfPart outer, inner;
    outer.fill(-kInfinity);
    inner.fill(-kInfinity);
    const Receivers::SlotBoxes& boxes = receivers_.boxes[block_];
    for (const ShadowVolumes::Number number : numbers) {
      OfPart least;
      least.fill(kInfinity);
      const ShadowVolumes::Planes planes = volumes.outer(number);
      // Boxes of slanted patches reach through the surface that they are on; points do not.
      OfPart behind;
      behind.fill(-kInfinity);
      for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
        OfPart height;
        height.fill(kInfinity);
        lower(planes[kOwnPlane], receivers_.points(block_, k).position, part, height);
        raise(behind, height);
      }
      for (std::size_t p = 0; p < kOwnPlane; ++p) lower(planes[p], 1, boxes, part, least);
      for (std::size_t e = 0; e < kPart; ++e) least[e] = std::min(least[e], behind[e]);
      raise(outer, least);
      if (!volumes.is_certain(number)) continue;
      least.fill(kInfinity);
      for (const ShadowVolumes::Plane& plane : volumes.inner(number)) {
        lower(plane, -1, boxes, part, least);
      }
      raise(inner, least);
    }
    for (std::size_t e = 0; e < kPart; ++e) {
      shade[e] = inner[e] > 0 ? Shade::kHidden : outer[e] < 0 ? Shade::kFree : Shade::kPartly;
    }
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
