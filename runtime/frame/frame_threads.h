#pragma once

#include <memory>

#include "rebounce/scheduler.h"

namespace rebounce {

/// Threads that share the loops of frames with the thread that calls.
///
/// The caller takes tasks until none is left, and then waits only for those that others have begun:
/// a frame never waits for a thread that the system has not let run yet, as it does at the barriers
/// of OpenMP, where it also spins for milliseconds. At worst a loop takes as long as on one thread,
/// and a task more. Helpers look out for the next loop for a short time and then sleep.
///
/// Starts its threads when it is made, ends them with itself; a loop neither allocates nor locks.
class FrameThreads {
 public:
  /// As many as default_thread_count(), the caller's among them. Loops use no more of them than
  /// that says when they begin.
  FrameThreads();
  ~FrameThreads();
  FrameThreads(const FrameThreads&) = delete;
  FrameThreads& operator=(const FrameThreads&) = delete;

  /// Runs loops here. Several threads may call it at the same time: while the helpers are with one
  /// of them, the others run their loops alone.
  Scheduler scheduler();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rebounce
