#pragma once

// Kernels are written over a vector type `V` of kWidth floats, one per instruction set: load,
// load_half, store, zero, broadcast, multiply_add, sum; load_some and store_some touch the first
// `count` lanes alone, the others are read as zero; sums gives the sums over the lanes of four
// vectors. Of vectors whose fours of lanes are the channels of something, repeat_four fills all
// fours with one, sums_of_fours adds up those of as many vectors as there are, and
// EntryLanes<Value>::load loads the entries of a coupling matrix; entries of kWholeRows load as
// many vectors of a row as there are with load_row. kStrip positions, the channels of kLights
// lights and kCouplingVectors vectors of a row of a coupling matrix are what its registers have
// room for. Everything about it is in an unnamed namespace, so that files compiled for different
// sets never share an instantiation.

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

// On functions and lambdas alike: arrays of vectors are kept in registers only if all that touches
// them is one function.
#define REBOUNCE_INLINE __attribute__((always_inline))

namespace rebounce {
namespace {

/// Asks for values that are read in order before their turn. Only registers of kRegister bytes that
/// are whole cache lines do: others would ask too often. They are brought to the second-level cache
/// alone: the nearest one has too few loads under way at a time for all that memory can give.
template <std::size_t kRegister, typename Value>
REBOUNCE_INLINE inline void ask_ahead(const Value* values) {
  // The processor itself looks no farther than the end of a page. Measured: notes/operator.md.
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

/// Calls work(index) for 0 to kCount - 1 as constants, so that arrays indexed by them are
/// registers.
template <std::size_t kCount, typename Work>
REBOUNCE_INLINE inline void unroll(const Work& work) {
  [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) REBOUNCE_INLINE {
    (work(std::integral_constant<std::size_t, kIndex>{}), ...);
  }
  (std::make_index_sequence<kCount>{});
}

/// Calls work.template operator()<rows>(first) for groups of kMost rows, and for what is left.
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
