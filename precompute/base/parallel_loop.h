#pragma once

#include <atomic>
#include <cstddef>
#include <exception>

namespace rebounce {

/// Calls work(k) for each k below `count` on OpenMP's threads, one index at a time, in any order.
/// Nothing can be thrown out of a parallel region: what a call throws is thrown here after the
/// loop. Calls that have not begun by then are left out.
template <typename Work>
void parallel_loop(std::size_t count, const Work& work) {
  std::exception_ptr failure;
  std::atomic<bool> failed = false;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < count; ++k) {
    if (failed) continue;
    try {
      work(k);
    } catch (...) {
#pragma omp critical
      if (!failed.exchange(true)) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace rebounce
