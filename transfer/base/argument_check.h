#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "rebounce/error.h"
#include "rebounce/types.h"

namespace rebounce {

/// Throws Error if `what`, "operator: indirect irradiance" for instance, has other than `wanted`
/// entries.
inline void check_size(const char* what, std::size_t size, std::size_t wanted) {
  if (size == wanted) return;
  throw Error(std::string(what) + " has " + std::to_string(size) + " entries; it must have " +
              std::to_string(wanted));
}

/// Throws Error if a workspace has less than `wanted` floats.
inline void check_workspace(const char* what, std::size_t size, std::size_t wanted) {
  if (size >= wanted) return;
  throw Error(std::string(what) + " has " + std::to_string(size) + " floats; it needs " +
              std::to_string(wanted));
}

/// True unless a channel is negative, above `most` or no number.
inline bool is_light(const Float3& light, float most = std::numeric_limits<float>::max()) {
  return std::ranges::all_of(light, [most](float x) { return x >= 0 && x <= most; });
}

/// Whether is_light is true of all; without a branch for each.
inline bool are_light(std::span<const Float3> lights,
                      float most = std::numeric_limits<float>::max()) {
  const auto* channel = reinterpret_cast<const float*>(lights.data());
  unsigned bad = 0;
  for (std::size_t k = 0; k < lights.size() * kChannelCount; ++k) {
    bad |= (channel[k] >= 0) & (channel[k] <= most) ? 0U : 1U;
  }
  return bad == 0;
}

/// Throws Error that names the first patch whose entry of `light` [n] is_light is false of.
inline void check_light_of_patches(const char* what, std::span<const Float3> light) {
  if (are_light(light)) return;
  const auto bad = std::ranges::find_if_not(light, [](const Float3& e) { return is_light(e); });
  throw Error(std::string(what) + " of patch " + std::to_string(bad - light.begin()) +
              " is negative or not finite; it must be in lx, at least 0");
}

}  // namespace rebounce
