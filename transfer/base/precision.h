#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "rebounce/operators.h"

namespace rebounce {

/// How the bases of a HierarchicalOperator are stored: IEEE numbers of 16 or 32 bits, or integers
/// of 8 bits.
enum class BasisPrecision : std::uint8_t { kF16, kF32, kQ8 };

/// How the coupling matrices and dense entries of a HierarchicalOperator are stored: IEEE numbers
/// of 16 or 32 bits, or rows of integers (RowFormat) beside dense entries in 16 bits.
enum class CouplingPrecision : std::uint8_t { kF16, kF32, kPacked };

struct HierarchicalPrecision {
  BasisPrecision bases = BasisPrecision::kF32;
  CouplingPrecision couplings = CouplingPrecision::kF32;

  bool operator==(const HierarchicalPrecision&) const = default;
};

/// A precision that the command line offers.
struct OfferedPrecision {
  Precision precision;
  const char* name;
  HierarchicalPrecision hierarchical;  ///< what it means for a HierarchicalOperator
};
inline constexpr std::array<OfferedPrecision, 3> kOfferedPrecisions{{
    {Precision::kF16, "f16", {BasisPrecision::kF16, CouplingPrecision::kF16}},
    {Precision::kF32, "f32", {BasisPrecision::kF32, CouplingPrecision::kF32}},
    {Precision::kQ8, "q8", {BasisPrecision::kQ8, CouplingPrecision::kPacked}},
}};

/// Whether bases of this precision are integers. Integers have an order of their own.
constexpr bool are_integers(BasisPrecision precision) {
  return precision == BasisPrecision::kQ8;
}

/// What `precision` means for a HierarchicalOperator.
HierarchicalPrecision hierarchical_precision(Precision precision);

/// Whether the command line offers this combination.
bool is_offered(const HierarchicalPrecision& precision);

/// The name on the command line. `precision` must be one that is offered.
std::string precision_name(const HierarchicalPrecision& precision);

}  // namespace rebounce
