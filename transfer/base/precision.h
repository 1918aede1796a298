#pragma once

#include <cstdint>
#include <string>

namespace rebounce {

/// How values are stored. kQ16 and kQ8, the bases of a HierarchicalOperator as integers of 16 or 8
/// bits and the rest as kF16, are for that alone.
enum class Precision : std::uint8_t { kF16, kF32, kQ16, kQ8 };

/// Whether it is one of these two.
constexpr bool has_integer_bases(Precision precision) {
  return precision == Precision::kQ16 || precision == Precision::kQ8;
}

/// As the command line names it: "f16", "f32", "q16", "q8".
std::string precision_name(Precision precision);

}  // namespace rebounce
