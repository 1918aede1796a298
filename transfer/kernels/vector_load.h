#pragma once

// Kernels are written over a vector type `V` of kWidth floats, one per instruction set. Basics:
// load, load_half, store, zero, broadcast, multiply_add, sum. load_some and store_some use only the
// first `count` lanes; load_some sets the others to zero. sums returns the sums over the lanes of
// four vectors.
//
// Some vectors hold groups of four lanes, each with the channels of one coefficient. repeat_four
// fills all groups with one coefficient, and sums_of_fours sums each group. EntryLanes<Value>::load
// loads entries of a coupling matrix; entries with kWholeRows load several vectors of a row at once
// with load_row.
//
// Three constants are limited by the number of registers: kStrip positions, the channels of kLights
// lights, and kCouplingVectors vectors of a row of a coupling matrix. Everything is in an unnamed
// namespace, so that files compiled for different sets never share an instantiation.

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

// For functions and lambdas. The compiler keeps arrays of vectors in registers only if all code
// that uses them is one function.
#define REBOUNCE_INLINE __attribute__((always_inline))

namespace rebounce {
namespace {

/// Prefetches values that are read in order. Only registers of kRegister bytes that fill whole
/// cache lines do so; others would prefetch too often. The values go to the second-level cache
/// only: the first-level cache has too few loads in flight to use the full memory bandwidth.
template <std::size_t kRegister, typename Value>
REBOUNCE_INLINE inline void prefetch_ahead(const Value* values) {
  // The processor's own prefetching stops at the end of a page (lab/051).
  constexpr std::size_t kLine = 64, kAhead = 16384;
  constexpr int kToRead = 0, kSecondLevel = 2;
  if constexpr (kRegister == kLine) {
    __builtin_prefetch(values + kAhead / sizeof(Value), kToRead, kSecondLevel);
  }
}

template <typename V>
inline V load_values(const float* p) {
  return V::load(p);
}

template <typename V>
inline V load_values(const std::uint16_t* p) {
  return V::load_half(p);
}

/// Calls work(index) for 0 to kCount - 1 as constants, so that arrays indexed by them stay in
/// registers.
template <std::size_t kCount, typename Work>
REBOUNCE_INLINE inline void unroll(const Work& work) {
  [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) REBOUNCE_INLINE {
    (work(std::integral_constant<std::size_t, kIndex>{}), ...);
  }
  (std::make_index_sequence<kCount>{});
}

/// Calls work.template operator()<rows>(first) for groups of kMost rows, then for the rest.
template <std::size_t kMost, typename Work>
REBOUNCE_INLINE inline void for_each_rows(std::size_t rows, const Work& work) {
  std::size_t r = 0;
  for (; r + kMost <= rows; r += kMost) work.template operator()<kMost>(r);
  unroll<kMost - 1>([&](auto left) REBOUNCE_INLINE {
    if (rows - r == left + 1) work.template operator()<left + 1>(r);
  });
}

}  // namespace
}  // namespace rebounce
