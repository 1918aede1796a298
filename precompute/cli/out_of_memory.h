#pragma once

namespace rebounce::cli {

/// What is said where memory runs out.
inline constexpr char kOutOfMemory[] = "out of memory; take fewer patches or a smaller scene";

}  // namespace rebounce::cli
