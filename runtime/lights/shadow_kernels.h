#pragma once

// Comparisons of points and boxes with the planes of shadow volumes, for one instruction set.

#include <cstddef>
#include <cstdint>
#include <span>

namespace rebounce {

/// Planes of occluders by coordinates. A point p is on the inner side if
/// x p.x + y p.y + z p.z >= distance.
struct PlaneLanes {
  static constexpr std::size_t kLanes = 8;
  float x[kLanes], y[kLanes], z[kLanes], distance[kLanes];
};

/// The planes of a shadow volume: its inside is on the inner side of all of them.
struct VolumePlanes {
  static constexpr std::size_t kPlanes = 5;
  struct Plane {
    float x, y, z, distance;
  };
  Plane plane[kPlanes];
};

using VolumeNumber = std::uint32_t;

/// Points that are compared at a time.
inline constexpr std::size_t kShadowLanes = 16;

struct ShadowKernels {
  const char* name;

  /// Bit k of the result tells whether a box along the axes (`middle`, `half` sides) meets volume
  /// k, whose planes are lane k of `plane` [VolumePlanes::kPlanes], if `sign` is 1; whether it is
  /// wholly inside if `sign` is -1.
  unsigned (*box_in_volumes)(const PlaneLanes* plane, const float* middle, const float* half,
                             float sign);
  /// depth[e] = how far point e is inside of any of the `count` volumes with these numbers; below 0
  /// outside of all. Coordinates [axis][lane] are `stride` floats apart. Returns the least.
  float (*points_in_volumes)(const VolumePlanes* volume, const VolumeNumber* number,
                             std::size_t count, const float* position, std::size_t stride,
                             float* depth);
  /// What stands between points and a place for each of them. `piece`: by the numbers of volumes,
  /// the planes of an occluder's sides, with it on their inner side, and last its own. Only those
  /// in whose `volume` a point lies that is `open` (not 0) are looked at. `path`
  /// [place][axis][lane]: from the points to places; `hidden` [place][lane] becomes 1 where a piece
  /// crosses it, but for the end of the path beyond `length` of it.
  void (*hide_places)(const VolumePlanes* volume, const VolumePlanes* piece,
                      const VolumeNumber* number, std::size_t count, const float* position,
                      std::size_t stride, const float* open, const float* path,
                      std::size_t place_count, float length, float* hidden);
};

/// Those that this processor can run, the portable ones first.
std::span<const ShadowKernels* const> shadow_kernel_sets();

/// The last of them.
const ShadowKernels& shadow_kernels();

extern const ShadowKernels kShadowKernelsPortable, kShadowKernelsAvx2, kShadowKernelsAvx512;

}  // namespace rebounce
