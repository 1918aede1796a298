#pragma once

#include <atomic>

namespace rebounce::test {

inline std::atomic<bool> counting_allocations = false;
inline std::atomic<int> counted_allocations = 0;

/// The number of allocations on any thread while `work` runs.
template <typename Work>
int count_allocations(const Work& work) {
  counted_allocations = 0;
  counting_allocations = true;
  work();
  counting_allocations = false;
  return counted_allocations;
}

}  // namespace rebounce::test
