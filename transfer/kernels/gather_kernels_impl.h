#pragma once

// The kernels on rows of F, written once over a vector type `V` with kWidth floats: load, store,
// zero, broadcast, add, multiply_add, sum. One file per instruction set includes this. Everything
// is in an unnamed namespace, so that no two sets share an instantiation.

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "rebounce/types.h"
#include "transfer/kernels/gather_kernels.h"

namespace rebounce {
namespace {

template <typename V>
void gather_blocks(const FormFactorBlock* values, const std::uint32_t* position, std::size_t count,
                   const float* x, std::size_t stride, float* sum) {
  constexpr std::size_t kVectors = kFormFactorBlock / V::kWidth;
  // Sums of partial sums: a lane adds at most this many blocks at a time, which keeps rounding
  // errors small.
  constexpr std::size_t kBlocksOfSum = 64;
  V total[kChannelCount] = {V::zero(), V::zero(), V::zero()};
  for (std::size_t begin = 0; begin < count; begin += kBlocksOfSum) {
    const std::size_t end = std::min(begin + kBlocksOfSum, count);
    // Two independent sums per channel, to hide the latency of additions.
    V even[kChannelCount] = {V::zero(), V::zero(), V::zero()};
    V odd[kChannelCount] = {V::zero(), V::zero(), V::zero()};
    const auto add_block = [&](std::size_t k, V* part) {
      const float* at = x + kFormFactorBlock * static_cast<std::size_t>(position[k]);
      for (std::size_t v = 0; v < kVectors; ++v) {
        const V f = V::load(values[k].value + v * V::kWidth);
        for (int c = 0; c < kChannelCount; ++c) {
          part[c] = multiply_add(f, V::load(at + c * stride + v * V::kWidth), part[c]);
        }
      }
    };
    std::size_t k = begin;
    for (; k + 1 < end; k += 2) {
      add_block(k, even);
      add_block(k + 1, odd);
    }
    if (k < end) add_block(k, even);
    for (int c = 0; c < kChannelCount; ++c) total[c] = add(total[c], add(even[c], odd[c]));
  }
  for (int c = 0; c < kChannelCount; ++c) sum[c] = total[c].sum();
}

template <typename V>
void gather_and_spread_blocks(const FormFactorBlock* values, const std::uint32_t* position,
                              std::size_t count, const float* value, const float* x, float* y,
                              std::size_t stride, float* sum) {
  constexpr std::size_t kVectors = kFormFactorBlock / V::kWidth;
  const V sent[kChannelCount] = {V::broadcast(value[0]), V::broadcast(value[1]),
                                 V::broadcast(value[2])};
  V total[kChannelCount] = {V::zero(), V::zero(), V::zero()};
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = kFormFactorBlock * static_cast<std::size_t>(position[k]);
    for (std::size_t v = 0; v < kVectors; ++v) {
      const V f = V::load(values[k].value + v * V::kWidth);
      for (int c = 0; c < kChannelCount; ++c) {
        const std::size_t j = at + c * stride + v * V::kWidth;
        total[c] = multiply_add(f, V::load(x + j), total[c]);
        multiply_add(f, sent[c], V::load(y + j)).store(y + j);
      }
    }
  }
  for (int c = 0; c < kChannelCount; ++c) sum[c] = total[c].sum();
}

template <typename V>
void spread_blocks(const FormFactorBlock* values, const std::uint32_t* position, std::size_t count,
                   const float* value, float* y, std::size_t stride) {
  constexpr std::size_t kVectors = kFormFactorBlock / V::kWidth;
  const V sent[kChannelCount] = {V::broadcast(value[0]), V::broadcast(value[1]),
                                 V::broadcast(value[2])};
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = kFormFactorBlock * static_cast<std::size_t>(position[k]);
    for (std::size_t v = 0; v < kVectors; ++v) {
      const V f = V::load(values[k].value + v * V::kWidth);
      for (int c = 0; c < kChannelCount; ++c) {
        const std::size_t j = at + c * stride + v * V::kWidth;
        multiply_add(f, sent[c], V::load(y + j)).store(y + j);
      }
    }
  }
}

template <typename V>
constexpr GatherKernels make_gather_kernels() {
  return {gather_blocks<V>, gather_and_spread_blocks<V>, spread_blocks<V>};
}

}  // namespace
}  // namespace rebounce
