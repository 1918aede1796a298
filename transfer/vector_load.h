#pragma once

// Kernels are written over a vector type `V` of kWidth floats, one per instruction set: load,
// load_half, store, zero, broadcast, multiply_add, sum. Everything about it is in an unnamed
// namespace, so that files compiled for different sets never share an instantiation.

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

}  // namespace
}  // namespace rebounce
