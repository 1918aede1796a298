#pragma once

namespace rebounce::cli {

/// What is said where memory runs out.
inline constexpr char kOutOfMemory[] = "out of memory; ask for fewer patches";

}  // namespace rebounce::cli
