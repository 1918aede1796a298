#pragma once

// How applies, frames and solves share their loops out among threads.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "rebounce/scheduler.h"

namespace rebounce {

/// A loop that calls work(i) for each i in [0, count); it refers to `work`.
struct ParallelLoop {
  std::uint32_t count;
  Scheduler::Task task;
  void* context;

  template <typename Work>
  ParallelLoop(std::size_t task_count, const Work& work)
      : count(static_cast<std::uint32_t>(task_count)),
        task([](void* of_work, std::uint32_t index) {
          (*static_cast<const Work*>(of_work))(index);
        }),
        context(const_cast<Work*>(&work)) {}
};

/// Runs the loops one after the other, each when all tasks of the one before are done. Allocates
/// nothing. A scheduler is not asked for a loop of less than two tasks.
void run_in_turn(const Scheduler& scheduler, std::initializer_list<ParallelLoop> loops);

/// Calls work(i) for each i in [0, count). A call should take some 10 microseconds or more.
template <typename Work>
void parallel_for(const Scheduler& scheduler, std::size_t count, const Work& work) {
  run_in_turn(scheduler, {{count, work}});
}

/// The number of pieces of `size` entries, the last of which may be smaller, that `count` make.
constexpr std::size_t piece_count(std::size_t count, std::size_t size) {
  return (count + size - 1) / size;
}

/// The task of a loop over pieces: it calls work(i) for each entry i of its piece.
template <typename Work>
auto on_piece(std::size_t count, std::size_t size, const Work& work) {
  return [=, &work](std::size_t piece) {
    const std::size_t end = std::min(count, (piece + 1) * size);
    for (std::size_t i = piece * size; i < end; ++i) work(i);
  };
}

/// Calls work(i) for each i in [0, count), for `size` of them in a task.
template <typename Work>
void parallel_for_pieces(const Scheduler& scheduler, std::size_t count, std::size_t size,
                         const Work& work) {
  parallel_for(scheduler, piece_count(count, size), on_piece(count, size, work));
}

}  // namespace rebounce
