#pragma once

// The loops of ShadowKernels, for the instruction set that a file is compiled for. No function of
// a library is called: it would be compiled for wide instructions and used everywhere.

#include "runtime/lights/shadow_kernels.h"

namespace rebounce {
namespace {

constexpr float kBeyondAll = 3.4e38F;

inline float smaller(float a, float b) {
  return a < b ? a : b;
}
inline float larger(float a, float b) {
  return a > b ? a : b;
}
inline float magnitude(float a) {
  return __builtin_fabsf(a);
}
inline float multiply_add(float a, float b, float c) {
#ifdef __FMA__
  return __builtin_fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

unsigned box_in_volumes(const PlaneLanes* plane, const float* middle, const float* half,
                        float sign) {
  const float x = middle[0], y = middle[1], z = middle[2];
  const float half_x = sign * half[0], half_y = sign * half[1], half_z = sign * half[2];
  float all[PlaneLanes::kLanes];
  for (float& value : all) value = kBeyondAll;
  for (std::size_t p = 0; p < VolumePlanes::kPlanes; ++p) {
    const PlaneLanes& here = plane[p];
#pragma omp simd
    for (std::size_t k = 0; k < PlaneLanes::kLanes; ++k) {
      const float height = multiply_add(
          here.x[k], x, multiply_add(here.y[k], y, multiply_add(here.z[k], z, -here.distance[k])));
      const float furthest =
          multiply_add(magnitude(here.x[k]), half_x,
                       multiply_add(magnitude(here.y[k]), half_y,
                                    multiply_add(magnitude(here.z[k]), half_z, height)));
      all[k] = smaller(all[k], furthest);
    }
  }
  unsigned inside = 0;
#pragma omp simd reduction(| : inside)
  for (std::size_t k = 0; k < PlaneLanes::kLanes; ++k) inside |= all[k] >= 0 ? 1U << k : 0U;
  return inside;
}

float points_in_volumes(const VolumePlanes* volume, std::size_t count, const float* position,
                        std::size_t stride, float* depth) {
  const float *x = position, *y = position + stride, *z = position + 2 * stride;
  float most[kShadowLanes];
  for (float& value : most) value = -kBeyondAll;
  for (std::size_t k = 0; k < count; ++k) {
    const auto& plane = volume[k].plane;
#pragma omp simd
    for (std::size_t i = 0; i < kShadowLanes; ++i) {
      const auto height = [&](const VolumePlanes::Plane& p) {
        return multiply_add(p.x, x[i],
                            multiply_add(p.y, y[i], multiply_add(p.z, z[i], -p.distance)));
      };
      const float least =
          smaller(smaller(smaller(height(plane[0]), height(plane[1])), height(plane[2])),
                  smaller(height(plane[3]), height(plane[4])));
      most[i] = larger(most[i], least);
    }
  }
  float all = kBeyondAll;
#pragma omp simd reduction(min : all)
  for (std::size_t i = 0; i < kShadowLanes; ++i) {
    depth[i] = most[i];
    all = smaller(all, most[i]);
  }
  return all;
}

constexpr ShadowKernels make_shadow_kernels(const char* name) {
  return {name, box_in_volumes, points_in_volumes};
}

}  // namespace
}  // namespace rebounce
