#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
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

/// True unless a channel is negative or not finite.
inline bool is_light(const Float3& light) {
  return std::ranges::all_of(light, [](float x) { return std::isfinite(x) && x >= 0; });
}

/// Throws Error that names the first patch whose entry of `light` [n] is_light is false of.
inline void check_light_of_patches(const char* what, std::span<const Float3> light) {
  const auto bad = std::ranges::find_if_not(light, is_light);
  if (bad == light.end()) return;
  throw Error(std::string(what) + " of patch " + std::to_string(bad - light.begin()) +
              " is negative or not finite; it must be in lx, at least 0");
}

}  // namespace rebounce
