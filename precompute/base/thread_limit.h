#pragma once

#include <omp.h>

#include <algorithm>

namespace rebounce {

/// Limits the number of OpenMP threads of the parallel regions that the current thread begins, for
/// the lifetime of the object.
class ThreadLimit {
 public:
  /// `count` > 0.
  explicit ThreadLimit(int count) : before_(omp_get_max_threads()) {
    omp_set_num_threads(std::min(count, before_));
  }
  ~ThreadLimit() { omp_set_num_threads(before_); }
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  int before_;
};

}  // namespace rebounce
