#pragma once

#include <cstdint>

namespace rebounce {

/// The precision in which the system is inverted. Single precision takes half of the time and is
/// enough for operators that are compressed; double precision is for reference operators.
enum class Arithmetic : std::uint8_t { kDouble, kSingle };

}  // namespace rebounce
