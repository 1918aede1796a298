#pragma once

#include <cstddef>
#include <exception>

namespace rebounce::bench {

/// Runs `work(k)` for every k below `count`, shared out among OpenMP threads; loops inside of
/// `work` have one thread each. Throws the first exception that was met.
template <typename Work>
void in_parallel(std::size_t count, const Work& work) {
  std::exception_ptr failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < count; ++k) {
    try {
      work(k);
    } catch (...) {
#pragma omp critical
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace rebounce::bench
