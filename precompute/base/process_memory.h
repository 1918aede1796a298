#pragma once

#include <cstdint>

namespace rebounce {

/// The memory of this process that is in use at present, in bytes, as the kernel counts it
/// (resident); 0 where it does not tell.
std::uint64_t resident_memory_bytes();

}  // namespace rebounce
