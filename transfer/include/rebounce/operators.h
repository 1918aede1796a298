#pragma once

// What operators there are, by name.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace rebounce {

enum class OperatorKind : std::uint8_t {
  kDense,         ///< exact to rounding, with n² values a channel
  kHierarchical,  ///< to a tolerance, in a small part of the bytes and the time
  kLowRank,       ///< one rank for the whole scene
  kNoOperator,    ///< nothing is made or checked: for solves with the form factors
};

struct NamedOperatorKind {
  OperatorKind kind;
  const char* name;  ///< as files and the command line have it
};
inline constexpr std::array<NamedOperatorKind, 3> kOperatorKinds{{
    {OperatorKind::kHierarchical, "hierarchical"},
    {OperatorKind::kLowRank, "low-rank"},
    {OperatorKind::kDense, "dense"},
}};

/// The name of a kind of kOperatorKinds; "none" of others.
const char* operator_name(OperatorKind kind);

/// The kind of that name. Throws Error if there is none.
OperatorKind operator_kind(std::string_view name);

/// How the values of an operator are stored. kQ8 is for hierarchical ones alone: bases as integers
/// of 8 bits, and the rest as kF16.
enum class Precision : std::uint8_t { kF16, kF32, kQ8 };

/// As the command line names it: "f16", "f32", "q8".
std::string precision_name(Precision precision);

/// The precision of that name. Throws Error if there is none.
Precision precision_named(std::string_view name);

}  // namespace rebounce
