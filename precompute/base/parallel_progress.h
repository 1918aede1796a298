#pragma once

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "precompute/base/progress.h"
#include "rebounce/error.h"

namespace rebounce {

/// Progress of a loop that OpenMP threads share: counts finished iterations, reports on the thread
/// that began the loop, and keeps whether the loop has to stop. An OpenMP loop cannot be left
/// early, so iterations that find stopped() do nothing.
class ParallelProgress {
 public:
  /// `count` iterations, or other units of their work; `progress` must outlive it.
  ParallelProgress(const Progress& progress, std::size_t count)
      : progress_(progress), count_(std::max<std::size_t>(count, 1)) {}

  bool stopped() const { return stop_; }

  /// Counts a finished iteration, of `units`.
  void advance(std::size_t units = 1) {
    const double done = static_cast<double>(done_ += units);
    if (progress_ && omp_get_thread_num() == 0 && !progress_(done / static_cast<double>(count_))) {
      stop_ = true;
    }
  }

  /// As stopped(), but asks once more: for iterations that take long.
  bool look() {
    if (progress_ && omp_get_thread_num() == 0 &&
        !progress_(static_cast<double>(done_) / static_cast<double>(count_))) {
      stop_ = true;
    }
    return stop_;
  }

  /// Call this after the loop. Throws Cancelled if the loop was stopped.
  void finish() const {
    if (stop_) throw Cancelled();
  }

 private:
  const Progress& progress_;
  std::size_t count_;
  std::atomic<std::size_t> done_ = 0;
  std::atomic<bool> stop_ = false;
};

}  // namespace rebounce
