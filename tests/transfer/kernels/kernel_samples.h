#pragma once

// What the tests of block kernels share.

#include <algorithm>
#include <random>
#include <vector>

#include "transfer/base/half_float.h"
#include "transfer/kernels/block_kernels.h"

namespace rebounce::test {

/// Vectors and matrices with random entries that half precision holds exactly.
struct Random {
  std::mt19937 engine{3};
  std::vector<float> floats(std::size_t size) {
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> values(size);
    for (float& v : values) v = half_to_float(float_to_half(uniform(engine)));
    return values;
  }
};

inline std::vector<std::uint16_t> to_half(const std::vector<float>& values) {
  std::vector<std::uint16_t> half(values.size());
  std::ranges::transform(values, half.begin(), float_to_half);
  return half;
}

// Relative to sums of up to 96 products of numbers below 1.
inline constexpr double kAllowed = 1e-5;

// What a kernel must not touch keeps this value.
inline constexpr float kUntouched = -1234;

inline PlanarVectors<const float> planar(const std::vector<float>& data, std::size_t count) {
  return {data.data(), data.size() / count, count};
}
inline PlanarVectors<float> planar(std::vector<float>& data, std::size_t count) {
  return {data.data(), data.size() / count, count};
}

template <typename T>
Coefficients<T> side_by_side(std::vector<std::remove_const_t<T>>& data, std::size_t lights) {
  return {data.data(), data.size() / lights};
}

}  // namespace rebounce::test
