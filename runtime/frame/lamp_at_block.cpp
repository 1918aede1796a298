#include "runtime/frame/lamp_at_block.h"

#include <algorithm>
#include <array>

#include "runtime/lights/lamp_shadows.h"
#include "runtime/lights/light_sampling.h"

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
              const OccluderGroups& occluders, const ShadowVolumes& volumes, std::size_t block,
              std::span<float> irradiance)
      : receivers_(receivers),
        lamp_(lamp),
        occluders_(occluders),
        volumes_(volumes),
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

  /// Occluders in whose volumes some points of a part may be.
  struct Before {
    std::array<ShadowVolumes::Number, kMostOfPart> all, certain;
    std::size_t count = 0, certain_count = 0;
    bool is_whole = false;  ///< nothing else stands before the part
    bool is_solid = false;  ///< and light gets through none of them
  };

  const Box& bounds(std::size_t part) const {
    return receivers_.bounds[block_ * reached_.size() + part].box;
  }

  std::size_t slots_end(std::size_t part) const {
    return std::min(irradiance_.size(), (part + 1) * kPart);
  }

  /// Adds the light of a part. `groups`: of occluders, if `between` is kSome.
  void add_part(std::size_t part, Between between, Numbers groups) {
    Before before;
    if (between == Between::kSome) {
      between = volumes_.between(bounds(part), groups, before.all, before.count);
    }
    if (between == Between::kHidden) return;
    before.is_whole = between == Between::kSome && occluders_.is_whole;
    before.is_solid = before.is_whole;
    for (const ShadowVolumes::Number number : std::span(before.all).first(before.count)) {
      before.is_solid &= occluders_.is_solid(number);
      if (volumes_.is_certain(number)) before.certain[before.certain_count++] = number;
    }
    if (lamp_.has_area()) {
      add_surface(before, part);
    } else if (before.is_whole && before.certain_count == before.count) {
      add_lit_points(before, part);
    } else {
      add_points(before, part);
    }
  }

  /// How far point k of each slot of a part is in some of `volumes`. Returns the least.
  float depth_in(std::span<const VolumePlanes> volumes, Numbers numbers, std::size_t k,
                 std::size_t part, Depths& depth) const {
    const PatchPointBlock& points = receivers_.points(block_, k);
    return kernels_.points_in_volumes(volumes.data(), numbers.data(), numbers.size(),
                                      points.position[0].data() + part * kPart, kBlock,
                                      depth.data());
  }

  /// What is in the way to point k of each slot of a part: nothing, something that hides the whole
  /// lamp, or what only rays tell.
  enum class Way : std::uint8_t { kFree, kHidden, kUnknown };
  using Ways = std::array<Way, kPart>;

  /// Returns false if all are hidden.
  bool look(const Before& before, std::size_t k, std::size_t part, Ways& ways) const {
    Depths partly, wholly;
    const Numbers certain = std::span(before.certain).first(before.certain_count);
    if (depth_in(volumes_.inner(), certain, k, part, wholly) >= 0) return false;
    depth_in(volumes_.outer(), std::span(before.all).first(before.count), k, part, partly);
    for (std::size_t e = 0; e < kPart; ++e) {
      const bool free = before.is_whole && partly[e] < 0;
      ways[e] = wholly[e] >= 0 ? Way::kHidden : free ? Way::kFree : Way::kUnknown;
    }
    return true;
  }

  /// Adds the light of a lamp without a surface to a part of which volumes tell all.
  void add_lit_points(const Before& before, std::size_t part) {
    BlockLight light;
    const float share = share_;
    const Numbers all = std::span(before.all).first(before.count);
    Depths depth, sum{};
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      if (depth_in(volumes_.outer(), all, k, part, depth) >= 0) continue;
      light.evaluate(lamp_, receivers_.points(block_, k), part);
#pragma omp simd
      for (std::size_t e = 0; e < kPart; ++e) {
        const float arriving = light.arriving[part * kPart + e];
        const float free = depth[e] < 0 ? share : 0.0F;
        sum[e] += free * (arriving > 0 ? arriving : 0.0F);
      }
    }
    for (std::size_t slot = part * kPart; slot < slots_end(part); ++slot) {
      irradiance_[slot] += sum[slot - part * kPart];
    }
  }

  /// The same, by rays where volumes do not tell.
  void add_points(const Before& before, std::size_t part) {
    std::array<BlockLight, kPointsAtOnce> light;
    std::array<Ways, kPointsAtOnce> ways;
    for (std::size_t first = 0; first < receivers_.points_per_patch; first += kPointsAtOnce) {
      const std::size_t last = std::min(first + kPointsAtOnce, receivers_.points_per_patch);
      for (std::size_t k = first; k < last; ++k) {
        if (!look(before, k, part, ways[k - first])) ways[k - first].fill(Way::kHidden);
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
  void add_surface(const Before& before, std::size_t part) {
    Ways ways;
    PartValues unoccluded, seen;
    for (std::size_t k = 0; k < receivers_.points_per_patch; ++k) {
      if (!look(before, k, part, ways)) continue;
      lamp_.unoccluded_irradiance(receivers_.points(block_, k), part, unoccluded);
      PartValues open;
      bool any_open = false;
      for (std::size_t e = 0; e < kPart; ++e) {
        open[e] = ways[e] == Way::kUnknown && unoccluded[e] > 0 ? 1.0F : 0.0F;
        any_open |= open[e] > 0;
      }
      if (any_open && before.is_solid) find_seen(before, k, part, open, seen);
      for (std::size_t slot = part * kPart; slot < slots_end(part); ++slot) {
        const std::size_t e = slot - part * kPart;
        if (ways[e] == Way::kFree) {
          irradiance_[slot] += share_ * unoccluded[e];
        } else if (open[e] > 0) {
          if (before.is_solid && seen[e] >= 0) {
            irradiance_[slot] += share_ * unoccluded[e] * seen[e];
          } else {
            add_surface(k, slot);
          }
        }
      }
    }
  }

  /// Sample point j of the lamp for point k of a slot.
  float sample(std::size_t j, std::size_t k, std::size_t part, std::size_t e, int axis) const {
    const float moved = receivers_.places[k * receivers_.area_light_samples + j][axis] +
                        receivers_.shift[block_ * reached_.size() + part][axis][e];
    return moved < 1 ? moved : moved - 1;
  }

  /// The part of a lamp with a surface that is seen from point k of each slot of a part, by what
  /// its places add to its light; below 0 where they add nothing. `open`: which points matter.
  void find_seen(const Before& before, std::size_t k, std::size_t part, const PartValues& open,
                 PartValues& seen) const {
    const std::size_t count = receivers_.area_light_samples;
    const PatchPointBlock& points = receivers_.points(block_, k);
    std::array<std::array<PartValues, 3>, kMaxAreaLightSamples> path;
    std::array<PartValues, kMaxAreaLightSamples> weight, hidden;
    PartValues u, v;
    PlacesOfPart places;
    for (std::size_t j = 0; j < count; ++j) {
      for (std::size_t e = 0; e < kPart; ++e) {
        u[e] = sample(j, k, part, e, 0);
        v[e] = sample(j, k, part, e, 1);
      }
      lamp_.kind->surface->places_of_part(lamp_, points, part, u, v, places);
      path[j] = places.path;
      weight[j] = places.weight;
      hidden[j].fill(0);
    }
    kernels_.hide_places(volumes_.outer().data(), occluders_.piece.data(), before.all.data(),
                         before.count, points.position[0].data() + part * kPart, kBlock,
                         open.data(), path[0][0].data(), count, shadow_ray_length(1),
                         hidden[0].data());
    for (std::size_t e = 0; e < kPart; ++e) {
      float whole = 0, arriving = 0;
      for (std::size_t j = 0; j < count; ++j) {
        whole += weight[j][e];
        arriving += weight[j][e] * (1 - hidden[j][e]);
      }
      seen[e] = whole > 0 ? arriving / whole : -1.0F;
    }
  }

  /// Adds the light of a lamp with a surface at one point, by rays.
  void add_surface(std::size_t k, std::size_t slot) {
    const std::size_t count = receivers_.area_light_samples;
    std::array<glm::vec2, kMaxAreaLightSamples> places;
    for (std::size_t j = 0; j < count; ++j) {
      const std::size_t part = slot / kPart, e = slot % kPart;
      places[j] = {sample(j, k, part, e, 0), sample(j, k, part, e, 1)};
    }
    const PatchPointBlock& points = receivers_.points(block_, k);
    shadows_.add_surface(lamp_, {points.at(slot), points.normal_at(slot)},
                         std::span(places).first(count), share_, slot);
  }

  const Receivers& receivers_;
  const PreparedLight& lamp_;
  const OccluderGroups& occluders_;
  const ShadowVolumes& volumes_;
  const ShadowKernels& kernels_ = shadow_kernels();
  std::size_t block_;
  float share_;  ///< of each point of a patch
  std::span<float> irradiance_;
  LampShadows shadows_;
  Receivers::Reached reached_;
};

}  // namespace

void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const OccluderGroups& occluders, const ShadowVolumes& volumes, std::size_t block,
              std::span<float> irradiance) {
  LampAtBlock(receivers, tracer, lamp, occluders, volumes, block, irradiance).add();
}

}  // namespace rebounce
