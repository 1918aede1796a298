#include "transfer/base/parallel.h"

#ifdef _OPENMP
#include <omp.h>
#endif

#include <algorithm>

namespace rebounce {
namespace {

void run_here(const ParallelLoop& loop) {
  for (std::uint32_t i = 0; i < loop.count; ++i) loop.task(loop.context, i);
}

#ifdef _OPENMP
/// Whether a parallel region that begins here has more than one thread.
bool has_threads() {
  return omp_get_max_threads() > 1 && omp_get_active_level() < omp_get_max_active_levels();
}

/// Runs all loops in one parallel region: the threads start once and meet after each loop.
void run_with_openmp(std::initializer_list<ParallelLoop> loops) {
#pragma omp parallel
  for (const ParallelLoop& loop : loops) {
    if (loop.count == 0) continue;
#pragma omp for schedule(dynamic, 1)
    for (std::uint32_t i = 0; i < loop.count; ++i) loop.task(loop.context, i);
  }
}
#endif

}  // namespace

void run_in_turn(const Scheduler& scheduler, std::initializer_list<ParallelLoop> loops) {
#ifdef _OPENMP
  const auto is_shared = [](const ParallelLoop& loop) { return loop.count > 1; };
  if (scheduler.parallel_for == nullptr && has_threads() && std::ranges::any_of(loops, is_shared)) {
    run_with_openmp(loops);
    return;
  }
#endif
  for (const ParallelLoop& loop : loops) {
    if (scheduler.parallel_for != nullptr && loop.count > 1) {
      scheduler.parallel_for(scheduler.user, loop.count, loop.task, loop.context);
    } else {
      run_here(loop);
    }
  }
}

}  // namespace rebounce
