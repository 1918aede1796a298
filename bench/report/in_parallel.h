#pragma once

#include <omp.h>

#include <atomic>
#include <cstddef>
#include <exception>

#include "rebounce/precompute/progress.h"
#include "rebounce/transfer/error.h"

namespace rebounce::bench {

/// Runs `work(k)` for every k below `count`, shared out among OpenMP threads; loops inside of
/// `work` have one thread each. Throws the first exception that was met, and Cancelled when
/// `progress`, which the calling thread asks before each of its own, says so.
template <typename Work>
void in_parallel(std::size_t count, const Progress& progress, const Work& work) {
  std::exception_ptr failure;
  std::atomic<std::size_t> done = 0;
  std::atomic<bool> stop = false;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < count; ++k) {
    if (stop) continue;
    if (omp_get_thread_num() == 0 && !progress(static_cast<double>(done) / count)) stop = true;
    try {
      work(k);
    } catch (...) {
#pragma omp critical
      if (!failure) failure = std::current_exception();
    }
    ++done;
  }
  if (failure) std::rethrow_exception(failure);
  if (stop) throw Cancelled();
}

}  // namespace rebounce::bench
