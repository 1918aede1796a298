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

/// How far a point is on the inner side of a plane.
inline float height_over(const VolumePlanes::Plane& p, float x, float y, float z) {
  return multiply_add(p.x, x, multiply_add(p.y, y, multiply_add(p.z, z, -p.distance)));
}

/// How far a point is inside of a volume; below 0 outside.
inline float depth_in(const VolumePlanes& volume, float x, float y, float z) {
  const auto& plane = volume.plane;
  return smaller(smaller(smaller(height_over(plane[0], x, y, z), height_over(plane[1], x, y, z)),
                         height_over(plane[2], x, y, z)),
                 smaller(height_over(plane[3], x, y, z), height_over(plane[4], x, y, z)));
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

float points_in_volumes(const VolumePlanes* volume, const VolumeNumber* number, std::size_t count,
                        const float* position, std::size_t stride, float* depth) {
  const float *x = position, *y = position + stride, *z = position + 2 * stride;
  float most[kShadowLanes];
  for (float& value : most) value = -kBeyondAll;
  for (std::size_t k = 0; k < count; ++k) {
    const VolumePlanes asked = volume[number[k]];  // a copy: its planes stay in registers
#pragma omp simd
    for (std::size_t i = 0; i < kShadowLanes; ++i) {
      most[i] = larger(most[i], depth_in(asked, x[i], y[i], z[i]));
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

void hide_places(const VolumePlanes* volume, const VolumePlanes* piece, const VolumeNumber* number,
                 std::size_t count, const float* position, std::size_t stride, const float* open,
                 const float* path, std::size_t place_count, float length, float* hidden) {
  constexpr std::size_t kOwn = VolumePlanes::kPlanes - 1;
  const float *x = position, *y = position + stride, *z = position + 2 * stride;
  for (std::size_t k = 0; k < count; ++k) {
    const VolumePlanes asked = volume[number[k]];
    float any = 0;
#pragma omp simd reduction(max : any)
    for (std::size_t i = 0; i < kShadowLanes; ++i) {
      any = larger(any, depth_in(asked, x[i], y[i], z[i]) >= 0 ? open[i] : 0.0F);
    }
    if (any == 0) continue;
    const VolumePlanes::Plane* plane = piece[number[k]].plane;
    float over[VolumePlanes::kPlanes][kShadowLanes];
    for (std::size_t p = 0; p < VolumePlanes::kPlanes; ++p) {
      for (std::size_t i = 0; i < kShadowLanes; ++i) {
        over[p][i] = height_over(plane[p], x[i], y[i], z[i]);
      }
    }
    for (std::size_t s = 0; s < place_count; ++s) {
      const float* way = path + 3 * kShadowLanes * s;
      float* here = hidden + kShadowLanes * s;
#pragma omp simd
      for (std::size_t i = 0; i < kShadowLanes; ++i) {
        const float way_x = length * way[i], way_y = length * way[kShadowLanes + i],
                    way_z = length * way[2 * kShadowLanes + i];
        const auto along = [&](std::size_t p) {
          return multiply_add(plane[p].x, way_x,
                              multiply_add(plane[p].y, way_y, plane[p].z * way_z));
        };
        // It meets the piece's plane after a part from / by of its way, where it must be on the
        // inner side of all others.
        const float by = along(kOwn), from = magnitude(over[kOwn][i]), whole = magnitude(by);
        float inside = kBeyondAll;
        for (std::size_t p = 0; p < kOwn; ++p) {
          inside = smaller(inside, multiply_add(over[p][i], whole, along(p) * from));
        }
        const bool meets = over[kOwn][i] * (over[kOwn][i] + by) < 0;
        here[i] = larger(here[i], (inside >= 0) & meets ? 1.0F : 0.0F);
      }
    }
  }
}

constexpr ShadowKernels make_shadow_kernels(const char* name) {
  return {name, box_in_volumes, points_in_volumes, hide_places};
}

}  // namespace
}  // namespace rebounce
