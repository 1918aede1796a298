#pragma once

#include <cstddef>
#include <functional>

namespace rebounce::bench {

/// Seconds that all threads of this process have had a processor, so far and for `work`: what
/// others on the machine disturb less than the time that passes.
double processor_seconds();
double processor_seconds_of(const std::function<void()>& work);

/// The most memory that this process has had so far; 0 where it cannot be known.
std::size_t peak_memory_bytes();

}  // namespace rebounce::bench
