#include "runtime/frame/frame_threads.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "transfer/base/parallel.h"

namespace rebounce {
namespace {

// Looks for work, or for its end, before a thread sleeps or gives way: some 50 microseconds, more
// than what is between the loops of a frame, less than what is between frames.
constexpr int kSpins = 2000;

void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

}  // namespace

struct FrameThreads::Impl {
  Impl() {
    const int count = std::max(default_thread_count(), 1);
    for (int k = 0; k + 1 < count; ++k) {
      helpers.emplace_back([this, k] { help(static_cast<std::uint32_t>(k)); });
    }
  }

  ~Impl() {
    stops.store(true);
    ticket.store(next_round());
    ticket.notify_all();
    for (std::thread& helper : helpers) helper.join();
  }

  void run(std::uint32_t loop_count, Scheduler::Task loop_task, void* loop_context) {
    const auto wanted = static_cast<std::uint32_t>(
        std::clamp<int>(default_thread_count() - 1, 0, static_cast<int>(helpers.size())));
    if (wanted == 0 || is_busy.test_and_set(std::memory_order_acquire)) {
      for (std::uint32_t k = 0; k < loop_count; ++k) loop_task(loop_context, k);
      return;
    }
    // A ticket of the round that is closed fails to be claimed while the loop is changed.
    ticket.store(next_round());
    helper_count.store(wanted, std::memory_order_release);
    count.store(loop_count, std::memory_order_release);
    task.store(loop_task, std::memory_order_release);
    context.store(loop_context, std::memory_order_release);
    done.store(0, std::memory_order_release);
    ticket.store(next_round());
    ticket.notify_all();
    std::uint64_t seen = 0;
    while (run_task(seen)) {
    }
    for (int spins = 0; done.load(std::memory_order_acquire) < loop_count; ++spins) {
      spins < kSpins ? relax() : std::this_thread::yield();
    }
    is_busy.clear(std::memory_order_release);
  }

 private:
  /// The first ticket of the next round; rounds are closed and open by turns.
  std::uint64_t next_round() const { return ((ticket.load() >> 32) + 1) << 32; }

  /// Claims a task and runs it; false if there is none. `seen` is the ticket that it looked at.
  bool run_task(std::uint64_t& seen) {
    seen = ticket.load();
    while (true) {
      const auto index = static_cast<std::uint32_t>(seen);
      const bool is_open = (seen >> 32) % 2 == 0;
      // These are of the ticket's loop if the claim succeeds.
      const Scheduler::Task claimed = task.load(std::memory_order_acquire);
      void* const with = context.load(std::memory_order_acquire);
      if (!is_open || index >= count.load(std::memory_order_acquire)) return false;
      if (!ticket.compare_exchange_weak(seen, seen + 1)) continue;
      claimed(with, index);
      done.fetch_add(1, std::memory_order_acq_rel);
      return true;
    }
  }

  void help(std::uint32_t number) {
    int spins = 0;
    while (!stops.load()) {
      std::uint64_t seen = ticket.load();
      if (number < helper_count.load(std::memory_order_acquire) && run_task(seen)) {
        spins = 0;
      } else if (++spins < kSpins) {
        relax();
      } else {
        ticket.wait(seen);
        spins = 0;
      }
    }
  }

  // The upper half is the number of the round, closed if odd; the lower one the next task of its
  // loop.
  std::atomic<std::uint64_t> ticket = 0;
  std::atomic<std::uint32_t> helper_count = 0, count = 0, done = 0;
  std::atomic<Scheduler::Task> task = nullptr;
  std::atomic<void*> context = nullptr;
  std::atomic<bool> stops = false;
  std::atomic_flag is_busy;
  std::vector<std::thread> helpers;
};

FrameThreads::FrameThreads() : impl_(std::make_unique<Impl>()) {}

FrameThreads::~FrameThreads() = default;

Scheduler FrameThreads::scheduler() {
  return {[](void* user, std::uint32_t count, Scheduler::Task task, void* context) {
            static_cast<Impl*>(user)->run(count, task, context);
          },
          impl_.get()};
}

}  // namespace rebounce
