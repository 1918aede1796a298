#pragma once

#include <cstdint>

namespace rebounce {

/// A well-mixed function of its argument (the finalizer of MurmurHash3).
inline std::uint32_t hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bU;
  x ^= x >> 13;
  x *= 0xc2b2ae35U;
  return x ^ (x >> 16);
}

/// A number in [0, 1) for each (`seed`, `dimension`).
inline float hash_to_unit(std::uint32_t seed, std::uint32_t dimension) {
  return static_cast<float>(hash(hash(seed) + 0x9e3779b9U * (dimension + 1)) >> 8) * 0x1p-24F;
}

}  // namespace rebounce
