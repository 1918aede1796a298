#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "rebounce/types.h"
#include "transfer/operator/work_vectors.h"

namespace rebounce {

/// Four numbers that are computed with together.
using Four = float __attribute__((vector_size(16)));

inline Four load_four(const void* from) {
  Four four;
  std::memcpy(&four, from, sizeof four);
  return four;
}

/// The light of one of `n` patches; the last number is of no use. Reads into the next patch.
inline Four load_light(const Float3* light, std::size_t n, std::uint32_t patch) {
  if (patch + 1 < n) return load_four(light + patch);
  const auto& [r, g, b] = light[patch];
  return Four{r, g, b, 0};
}

/// The light of four patches, by channel.
struct FourLights {
  Four red, green, blue;

  static FourLights load(const Float3* light, std::size_t n, const std::uint32_t* patch) {
    const Four a = load_light(light, n, patch[0]), b = load_light(light, n, patch[1]);
    const Four c = load_light(light, n, patch[2]), d = load_light(light, n, patch[3]);
    const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const Four cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    return {__builtin_shufflevector(ab, cd, 0, 1, 4, 5),
            __builtin_shufflevector(ab, cd, 2, 3, 6, 7),
            __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 6, 2, 6),
                                    __builtin_shufflevector(c, d, 2, 6, 2, 6), 0, 1, 4, 5)};
  }

  void store(Float3* light, const std::uint32_t* patch) const {
    const Four first = __builtin_shufflevector(red, green, 0, 4, 1, 5);
    const Four last = __builtin_shufflevector(red, green, 2, 6, 3, 7);
    light[patch[0]] = {first[0], first[1], blue[0]};
    light[patch[1]] = {first[2], first[3], blue[1]};
    light[patch[2]] = {last[0], last[1], blue[2]};
    light[patch[3]] = {last[2], last[3], blue[3]};
  }
};

/// Light of patches in planes of one channel each, [count][n]. Each light of an apply takes three
/// of them; those that the last one lacks are dark.
template <typename T>
struct Planes {
  T* data;
  std::size_t count;
};

/// Copies the light of the patches to x, and what arrives from y to the patches.
struct LightOfPatches {
  std::span<const std::uint32_t> patch;                ///< [n] patch at each position
  std::span<const float> gather_scale, scatter_scale;  ///< [n] by position
  const WorkVectors& work;

  /// Light is prefetched this many positions ahead, to the second-level cache: it can have more
  /// loads in flight than the first-level cache (lab/051).
  static constexpr std::size_t kPatchesAhead = 64;
  static constexpr int kToRead = 0, kToWrite = 1, kSecondLevel = 2;

  /// Prefetches four patches, for positions kPatchesAhead after `k`.
  template <int kFor>
  void prefetch_patches(const Float3* light, std::size_t k) const {
    const std::size_t ahead = k + kPatchesAhead;
    if (ahead + 4 > patch.size()) return;
    for (std::size_t i = ahead; i < ahead + 4; ++i) {
      __builtin_prefetch(&light[patch[i]], kFor, kSecondLevel);
    }
  }

  void gather(std::span<const Float3> light, std::size_t begin, std::size_t end) const {
    const std::size_t n = patch.size(), stride = work.x.stride, last = std::min(end, n);
    for (std::size_t v = 0; v < work.x.count; v += kChannelCount) {
      const Float3* const from_light = light.data() + v / kChannelCount * n;
      float* const x = work.x.data + v * stride;
      std::size_t k = begin;
      for (; k + 4 <= last; k += 4) {
        prefetch_patches<kToRead>(from_light, k);
        const FourLights lights = FourLights::load(from_light, n, &patch[k]);
        const Four weight = load_four(&gather_scale[k]);
        const Four weighted[] = {weight * lights.red, weight * lights.green, weight * lights.blue};
        for (int c = 0; c < kChannelCount; ++c) {
          std::memcpy(x + c * stride + k, &weighted[c], sizeof(Four));
        }
      }
      for (; k < last; ++k) {
        const Float3& m = from_light[patch[k]];
        for (int c = 0; c < kChannelCount; ++c) x[c * stride + k] = gather_scale[k] * m[c];
      }
    }
    clear(work.x, std::max(begin, last), end);
  }

  void gather(const Planes<const float>& light, std::size_t begin, std::size_t end) const {
    const std::size_t n = patch.size(), last = std::min(end, n);
    for (std::size_t v = 0; v < work.x.count; ++v) {
      float* const x = work.x.data + v * work.x.stride;
      if (v >= light.count) {
        std::fill(x + begin, x + last, 0.0F);
        continue;
      }
      const float* const plane = light.data + v * n;
      for (std::size_t k = begin; k < last; ++k) x[k] = gather_scale[k] * plane[patch[k]];
    }
    clear(work.x, std::max(begin, last), end);
  }

  /// Writes the light at the positions `targets`, in ascending order.
  void scatter(std::span<const std::uint32_t> targets, std::span<Float3> light) const {
    const std::size_t n = patch.size(), stride = work.y.stride;
    for (std::size_t v = 0; v < work.y.count; v += kChannelCount) {
      Float3* const to_light = light.data() + v / kChannelCount * n;
      const float* const y = work.y.data + v * stride;
      for (std::size_t t = 0; t < targets.size();) {
        const std::uint32_t k = targets[t];
        if (t + 3 < targets.size() && targets[t + 3] == k + 3) {
          prefetch_patches<kToWrite>(to_light, k);
          const Four weight = load_four(&scatter_scale[k]);
          const FourLights lights = {weight * load_four(y + k), weight * load_four(y + stride + k),
                                     weight * load_four(y + 2 * stride + k)};
          lights.store(to_light, &patch[k]);
          t += 4;
          continue;
        }
        for (int c = 0; c < kChannelCount; ++c) {
          to_light[patch[k]][c] = scatter_scale[k] * y[c * stride + k];
        }
        ++t;
      }
    }
  }

  void scatter(std::span<const std::uint32_t> targets, const Planes<float>& light) const {
    for (std::size_t v = 0; v < light.count; ++v) {
      float* const plane = light.data + v * patch.size();
      const float* const y = work.y.data + v * work.y.stride;
      for (const std::uint32_t k : targets) plane[patch[k]] = scatter_scale[k] * y[k];
    }
  }

  /// Nothing arrives at the patches `dark`.
  void darken(std::span<const std::uint32_t> dark, std::span<Float3> light) const {
    for (std::size_t l = 0; l < work.light_count; ++l) {
      for (const std::uint32_t p : dark) light[l * patch.size() + p] = {0, 0, 0};
    }
  }

  void darken(std::span<const std::uint32_t> dark, const Planes<float>& light) const {
    for (std::size_t v = 0; v < light.count; ++v) {
      for (const std::uint32_t p : dark) light.data[v * patch.size() + p] = 0;
    }
  }
};

}  // namespace rebounce
