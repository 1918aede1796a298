#pragma once

#include <cstdint>

namespace rebounce {

/// In what the system is inverted: double precision, for operators that are compared with, or
/// single for those that are compressed, in half of the time.
enum class Arithmetic : std::uint8_t { kDouble, kSingle };

}  // namespace rebounce
