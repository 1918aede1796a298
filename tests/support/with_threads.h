#pragma once

#ifdef _OPENMP
#include <omp.h>
#endif

namespace rebounce::test {

/// What `make` returns where OpenMP has `count` threads, or with one thread in a build without it.
template <typename Make>
auto with_threads([[maybe_unused]] int count, const Make& make) {
#ifdef _OPENMP
  const int before = omp_get_max_threads();
  omp_set_num_threads(count);
  auto made = make();
  omp_set_num_threads(before);
  return made;
#else
  return make();
#endif
}

}  // namespace rebounce::test
