#pragma once

#include <cstdint>

namespace rebounce {

/// The memory of this process that is in use at present, in bytes, as the kernel counts it
/// (resident); 0 where it does not tell.
std::uint64_t resident_memory_bytes();

/// The most memory of this process that was in use at any time, in bytes, as the kernel counts it;
/// 0 where it does not tell.
std::uint64_t peak_memory_bytes();

/// Gives memory that is not in use back to the system, where the allocator keeps it (glibc).
void return_freed_memory();

}  // namespace rebounce
