#pragma once

// Kernels are written over a vector type `V` of kWidth floats, one per instruction set: load,
// load_half, load_bytes, store, zero, broadcast, multiply_add, sum; load_some and store_some touch
// the first `count` lanes alone, the others are read as zero; store_sums writes the sums over the
// lanes of four vectors. kStrip positions and the channels of kLights lights are what its registers
// have room for. Everything about it is in an unnamed namespace, so that files compiled for
// different sets never share an instantiation.

#include <cstdint>

namespace rebounce {
namespace {

template <typename V>
inline V load_values(const float* p) {
  return V::load(p);
}

template <typename V>
inline V load_values(const std::uint16_t* p) {
  return V::load_half(p);
}

template <typename V>
inline V load_values(const std::int8_t* p) {
  return V::load_bytes(p);
}

}  // namespace
}  // namespace rebounce
