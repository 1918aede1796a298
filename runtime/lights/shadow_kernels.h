#pragma once

// Comparisons of points and boxes with the planes of shadow volumes, for one instruction set.

#include <cstddef>
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

/// Points that are compared at a time.
inline constexpr std::size_t kShadowLanes = 16;

struct ShadowKernels {
  const char* name;

  /// Bit k of the result tells whether a box along the axes (`middle`, `half` sides) meets volume
  /// k, whose planes are lane k of `plane` [VolumePlanes::kPlanes], if `sign` is 1; whether it is
  /// wholly inside if `sign` is -1.
  unsigned (*box_in_volumes)(const PlaneLanes* plane, const float* middle, const float* half,
                             float sign);
  /// depth[e] = how far point e is inside of any of the `count` volumes; below 0 outside of all.
  /// Coordinates [axis][lane] are `stride` floats apart. Returns the least.
  float (*points_in_volumes)(const VolumePlanes* volume, std::size_t count, const float* position,
                             std::size_t stride, float* depth);
};

/// Those that this processor can run, the portable ones first.
std::span<const ShadowKernels* const> shadow_kernel_sets();

/// The last of them.
const ShadowKernels& shadow_kernels();

extern const ShadowKernels kShadowKernelsPortable, kShadowKernelsAvx2, kShadowKernelsAvx512;

}  // namespace rebounce
