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
              const ShadowVolumes& volumes, bool is_whole, std::size_t block,
              std::span<float> irradiance)
      : receivers_(receivers),
        lamp_(lamp),
        volumes_(volumes),
        is_whole_(is_whole),
        block_(block),
        share_(1 / static_cast<float>(receivers.points_per_patch)),
        irradiance_(irradiance),
        shadows_(tracer, irradiance),
        reached_(receivers.reached(block, lamp)) {}

  void add() {
    Box box;
    for (std::size_t part = 0; part < reached_.size(); ++part) {
      if (!reached_[part]) continue;
      box.add(bounds(part).low);
      box.add(bounds(part).high);
    }
    if (box.low.x > box.high.x) return;
    std::array<ShadowVolumes::Number, kMostGroups> groups;
    std::size_t count = 0;
    const Between between = volumes_.groups_between(box, groups, count);
    if (between == Between::kHidden) return;
    for (std::size_t part = 0; part < reached_.size(); ++part) {
      if (reached_[part]) add_part(part, between, std::span(groups).first(count));
    }
    shadows_.flush();
  }

 private:
  using Between = ShadowVolumes::Between;

  /// Volumes that some points of a part may be in.
  struct Volumes {
    std::array<VolumePlanes, kMostOfPart> outer, inner;
    std::size_t outer_count = 0, inner_count = 0;
    bool are_all = false;  ///< nothing else stands before the part
  };

  const Box& bounds(std::size_t part) const {
    return receivers_.bounds[block_ * reached_.size() + part].box;
  }

  std::size_t slots_end(std::size_t part) const {
    return std::min(irradiance_.size(), (part + 1) * kPart);
  }

  /// Adds the light of a part. `groups`: of occluders, if `between` is kSome.
  void add_part(std::size_t part, Between between, Numbers groups) {
    std::array<ShadowVolumes::Number, kMostOfPart> numbers;
    std::size_t count = 0;
    if (between == Between::kSome) between = volumes_.between(bounds(part), groups, numbers, count);
    if (between == Between::kHidden) return;
    Volumes volumes;
    volumes.are_all = between == Between::kSome && is_whole_;
    for (const ShadowVolumes::Number number : std::span(numbers).first(count)) {
      volumes.outer[volumes.outer_count++] = volumes_.outer(number);
      if (volumes_.is_certain(number)) {
        volumes.inner[volumes.inner_count++] = volumes_.inner(number);
      }
    }
    if (lamp_.has_area()) {
      add_surface(volumes, part);
    } else if (volumes.are_all && volumes.inner_count == volumes.outer_count) {
      add_lit_points(volumes, part);
    } else {
      add_points(volumes, part);
    }
  }

  /// How far point k of each slot of a part is in the first `count` of `volumes`. Returns the
  /// least.
  float depth_in(std::span<const VolumePlanes> volumes, std::size_t k, std::size_t part,
                 Depths& depth) const {
    const PatchPointBlock& points = receivers_.points(block_, k);
    return kernels_.points_in_volumes(volumes.data(), volumes.size(),
                                      points.position[0].data() + part * kPart, kBlock,
                                      depth.data());
  }

  /// What is in the way to point k of each slot of a part: nothing, something that hides the whole
  /// lamp, or what only rays tell.
  enum class Way : std::uint8_t { kFree, kHidden, kUnknown };
  using Ways = std::array<Way, kPart>;

  /// Returns false if all are hidden.
  bool look(const Volumes& volumes, std::size_t k, std::size_t part, Ways& ways) const {
    Depths partly, wholly;
    if (depth_in(std::span(volumes.inner).first(volumes.inner_count), k, part, wholly) >= 0) {
      return false;
    }
    depth_in(std::span(volumes.outer).first(volumes.outer_count), k, part, partly);
    for (std::size_t e = 0; e < kPart; ++e) {
      const bool free = volumes.are_all && partly[e] < 0;
      ways[e] = wholly[e] >= 0 ? Way::kHidden : free ? Way::kFree : Way::kUnknown;
    }
    return true;
  }

  /// Adds the light of a lamp without a surface to a part of which volumes tell all.
  void add_lit_points(const Volumes& volumes, std::size_t part) {
    BlockLight light;
    const float share = share_;
    Depths depth, sum{};
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      if (depth_in(std::span(volumes.outer).first(volumes.outer_count), k, part, depth) >= 0) {
        continue;
      }
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

  /// The same, by rays where volumes do not tell.
  void add_points(const Volumes& volumes, std::size_t part) {
    std::array<BlockLight, kPointsAtOnce> light;
    std::array<Ways, kPointsAtOnce> ways;
    for (std::size_t first = 0; first < receivers_.points_per_patch; first += kPointsAtOnce) {
      const std::size_t last = std::min(first + kPointsAtOnce, receivers_.points_per_patch);
      for (std::size_t k = first; k < last; ++k) {
        if (!look(volumes, k, part, ways[k - first])) ways[k - first].fill(Way::kHidden);
        light[k - first].evaluate(lamp_, receivers_.points(block_, k), part);
      }
      // Rays from the points of a patch take nearly the same way, so they follow each other.
      for (std::size_t slot = part * kPart; slot < slots_end(part); ++slot) {
        for (std::size_t k = first; k < last; ++k) {
          const auto& [here, arriving] = light[k - first];
          const Way way = ways[k - first][slot - part * kPart];
          if (arriving[slot] <= 0 || way == Way::kHidden) continue;
          if (way == Way::kFree) {
            irradiance_[slot] += share_ * arriving[slot];
          } else {
            shadows_.add_ray(receivers_.points(block_, k).at(slot), here.at(slot),
                             share_ * arriving[slot], slot);
          }
        }
      }
    }
  }

  /// Adds the light of a lamp with a surface to a part.
  void add_surface(const Volumes& volumes, std::size_t part) {
    Ways ways;
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      if (!look(volumes, k, part, ways)) continue;
      const PatchPointBlock& points = receivers_.points(block_, k);
      for (std::size_t slot = part * kPart; slot < slots_end(part); ++slot) {
        const Way way = ways[slot - part * kPart];
        if (way == Way::kFree) {
          irradiance_[slot] +=
              share_ * lamp_.unoccluded_irradiance(points.at(slot), points.normal_at(slot));
        } else if (way == Way::kUnknown) {
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

  const Receivers& receivers_;
  const PreparedLight& lamp_;
  const ShadowVolumes& volumes_;
  bool is_whole_;
  const ShadowKernels& kernels_ = shadow_kernels();
  std::size_t block_;
  float share_;  ///< of each point of a patch
  std::span<float> irradiance_;
  LampShadows shadows_;
  Receivers::Reached reached_;
};

}  // namespace

void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const ShadowVolumes& volumes, bool is_whole, std::size_t block,
              std::span<float> irradiance) {
  LampAtBlock(receivers, tracer, lamp, volumes, is_whole, block, irradiance).add();
}

}  // namespace rebounce
