#pragma once

#include <cstdint>

#include "rebounce/error.h"
#include "transfer/base/half_float.h"
#include "transfer/format/operator_format.h"

namespace rebounce {

// Conversions between the stored values of a HierarchicalOperator and real numbers, by stored type.

/// The stored number that stands for 1 in bases.
template <typename Basis>
inline constexpr float kBasisScale = 1;
template <>
inline constexpr float kBasisScale<std::int8_t> = HierarchicalFormat::kByteScale;

/// The stored number that stands for 1 in coupling matrices and dense blocks.
template <typename Coupling>
inline constexpr float kCouplingScale = 1;
template <>
inline constexpr float kCouplingScale<std::uint16_t> = HierarchicalFormat::kHalfScale;

inline double as_number(float stored) {
  return stored;
}
inline double as_number(std::uint16_t half) {
  return half_to_float(half);
}
inline double as_number(std::int8_t stored) {
  return stored;
}

/// A value of a basis.
template <typename Basis>
double basis_value(Basis stored) {
  return as_number(stored) / double{kBasisScale<Basis>};
}

/// An entry of a coupling matrix or of a dense block.
template <typename Coupling>
double coupling_value(Coupling stored) {
  return as_number(stored) / double{kCouplingScale<Coupling>};
}

/// Stores an entry of a coupling matrix or of a dense block. Throws Error if it is out of range.
inline void store_coupling(float value, float& stored) {
  stored = value;
}
inline void store_coupling(float value, std::uint16_t& stored) {
  stored = float_to_half(value * kCouplingScale<std::uint16_t>);
  if ((stored & 0x7FFFU) >= 0x7C00U) {
    throw Error("an entry of the operator is too large for f16; use --precision f32");
  }
}

}  // namespace rebounce
