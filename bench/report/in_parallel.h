#pragma once

#include <cstddef>
#include <exception>

#include "precompute/base/parallel_progress.h"

namespace rebounce::bench {

/// Runs `work(k)` for every k below `count`, shared out among OpenMP threads; loops inside of
/// `work` have one thread each. Throws the first exception that was met, and Cancelled when
/// `progress` says so.
template <typename Work>
void in_parallel(std::size_t count, const Progress& progress, const Work& work) {
  std::exception_ptr failure;
  ParallelProgress loop(progress, count);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < count; ++k) {
    if (loop.stopped()) continue;
    try {
      work(k);
    } catch (...) {
#pragma omp critical
      if (!failure) failure = std::current_exception();
    }
    loop.advance();
  }
  if (failure) std::rethrow_exception(failure);
  loop.finish();
}

}  // namespace rebounce::bench
