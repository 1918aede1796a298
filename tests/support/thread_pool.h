#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "rebounce/scheduler.h"

namespace rebounce::test {

/// Threads that wait for loops, as an engine has them. Callers on several threads may share it, and
/// work on their own loops too. A loop allocates nothing; its tasks begin from the last to the
/// first.
class ThreadPool {
 public:
  explicit ThreadPool(int count) {
    for (int k = 0; k < count; ++k) threads_.emplace_back([this] { work(); });
  }
  ~ThreadPool() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  Scheduler scheduler() {
    return {[](void* pool, std::uint32_t count, Scheduler::Task task, void* context) {
              static_cast<ThreadPool*>(pool)->run({task, context, count, count, nullptr});
            },
            this};
  }

  /// Loops that it was called for.
  int loop_count() const { return loop_count_; }

 private:
  struct Loop {
    Scheduler::Task task;
    void* context;
    std::uint32_t waiting;     ///< tasks that nobody has begun
    std::uint32_t unfinished;  ///< tasks
    Loop* next;                ///< of those that have waiting tasks
  };

  void run(Loop loop) {
    ++loop_count_;
    std::unique_lock lock(mutex_);
    loop.next = loops_;
    loops_ = &loop;
    wake_.notify_all();
    take_tasks(loop, lock);
    done_.wait(lock, [&] { return loop.unfinished == 0; });
  }

  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return ends_ || loops_ != nullptr; });
      if (ends_) return;
      take_tasks(*loops_, lock);
    }
  }

  /// The loop lives on as long as the lock is held.
  void take_tasks(Loop& loop, std::unique_lock<std::mutex>& lock) {
    while (loop.waiting > 0) {
      const std::uint32_t index = --loop.waiting;
      if (index == 0) remove(loop);
      lock.unlock();
      loop.task(loop.context, index);
      lock.lock();
      if (--loop.unfinished == 0) {
        done_.notify_all();
        return;
      }
    }
  }

  void remove(const Loop& loop) {
    Loop** at = &loops_;
    while (*at != &loop) at = &(*at)->next;
    *at = loop.next;
  }

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  Loop* loops_ = nullptr;
  bool ends_ = false;
  std::atomic<int> loop_count_ = 0;
  std::vector<std::thread> threads_;
};

}  // namespace rebounce::test
