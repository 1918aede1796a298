#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace rebounce {

/// How values are stored. kQ16 and kQ8, the bases of a HierarchicalOperator as integers of 16 or 8
/// bits and the rest as kF16, are for that alone.
enum class Precision : std::uint8_t { kF16, kF32, kQ16, kQ8 };

/// Of the bases of a HierarchicalOperator: IEEE numbers of 16 or 32 bits, or integers.
enum class BasisPrecision : std::uint8_t { kF16, kF32, kQ16, kQ8 };

/// Of its coupling matrices and dense entries.
enum class CouplingPrecision : std::uint8_t { kF16, kF32 };

struct HierarchicalPrecision {
  BasisPrecision bases = BasisPrecision::kF32;
  CouplingPrecision couplings = CouplingPrecision::kF32;

  bool operator==(const HierarchicalPrecision&) const = default;
};

/// A precision as the command line offers it.
struct OfferedPrecision {
  Precision precision;
  const char* name;
  HierarchicalPrecision hierarchical;  ///< of a HierarchicalOperator
};
inline constexpr std::array<OfferedPrecision, 4> kOfferedPrecisions{{
    {Precision::kF16, "f16", {BasisPrecision::kF16, CouplingPrecision::kF16}},
    {Precision::kF32, "f32", {BasisPrecision::kF32, CouplingPrecision::kF32}},
    {Precision::kQ16, "q16", {BasisPrecision::kQ16, CouplingPrecision::kF16}},
    {Precision::kQ8, "q8", {BasisPrecision::kQ8, CouplingPrecision::kF16}},
}};

/// Whether bases are integers, which have an order of their own.
constexpr bool are_integers(BasisPrecision precision) {
  return precision == BasisPrecision::kQ16 || precision == BasisPrecision::kQ8;
}

/// What `precision` is for a HierarchicalOperator.
HierarchicalPrecision hierarchical_precision(Precision precision);

/// Whether some precision on offer is this one.
bool is_offered(const HierarchicalPrecision& precision);

/// As the command line names it: "f16", "f32", "q16", "q8".
std::string precision_name(Precision precision);

/// Likewise. `precision` must be on offer.
std::string precision_name(const HierarchicalPrecision& precision);

}  // namespace rebounce
