#pragma once

#include <omp.h>

namespace rebounce::test {

/// What `make` returns where OpenMP has `count` threads.
template <typename Make>
auto with_threads(int count, const Make& make) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(count);
  auto made = make();
  omp_set_num_threads(before);
  return made;
}

}  // namespace rebounce::test
