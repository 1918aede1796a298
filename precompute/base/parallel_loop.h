#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <optional>

namespace rebounce {

/// Calls work(k, scratch) for each k below `count` on OpenMP's threads, `together` indices at a
/// time, in any order. Each thread that has work makes a scratch of its own, by make_scratch().
/// Nothing can be thrown out of a parallel region: what a call throws is thrown here after the
/// loop. Calls that have not begun by then are left out.
template <typename MakeScratch, typename Work>
void parallel_loop(std::size_t count, int together, const MakeScratch& make_scratch,
                   const Work& work) {
  std::exception_ptr failure;
  std::atomic<bool> failed = false;
#pragma omp parallel
  {
    std::optional<decltype(make_scratch())> scratch;
#pragma omp for schedule(dynamic, together)
    for (std::size_t k = 0; k < count; ++k) {
      if (failed) continue;
      try {
        if (!scratch) scratch.emplace(make_scratch());
        work(k, *scratch);
      } catch (...) {
#pragma omp critical
        if (!failed.exchange(true)) failure = std::current_exception();
      }
    }
  }
  if (failure) std::rethrow_exception(failure);
}

/// The same without scratch, one index at a time.
template <typename Work>
void parallel_loop(std::size_t count, const Work& work) {
  parallel_loop(
      count, 1, [] { return 0; }, [&](std::size_t k, int) { work(k); });
}

}  // namespace rebounce
