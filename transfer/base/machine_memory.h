#pragma once

#include <cstdint>

namespace rebounce {

/// The memory of this machine, in bytes.
std::uint64_t machine_memory_bytes();

}  // namespace rebounce
