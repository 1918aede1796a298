#include "runtime/frame/frame_threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/allocation_counter.h"
#include "tests/support/with_threads.h"
#include "transfer/base/parallel.h"

namespace rebounce::test_frame_threads {
namespace {

/// Runs loops of `count` tasks, and expects each task to have run once in each.
void expect_all_run(const Scheduler& scheduler, std::uint32_t count, int loops) {
  std::vector<std::atomic<int>> runs(count);
  for (int k = 0; k < loops; ++k) {
    parallel_for(scheduler, count, [&](std::size_t i) { ++runs[i]; });
    for (const std::atomic<int>& of_task : runs) ASSERT_EQ(of_task, k + 1);
  }
}

std::shared_ptr<FrameThreads> threads_of(int count) {
  return test::with_threads(count, [] { return std::make_shared<FrameThreads>(); });
}

TEST(FrameThreads, EveryTaskRunsOnce) {
  for (const int threads : {1, 2, 5}) {
    const auto shared = threads_of(threads);
    test::with_threads(threads, [&] {
      for (const std::uint32_t count : {0U, 1U, 2U, 3U, 100U}) {
        expect_all_run(shared->scheduler(), count, 2000);
      }
      return 0;
    });
  }
}

TEST(FrameThreads, HelpersWakeAndHelp) {
  const auto shared = threads_of(3);
  test::with_threads(3, [&] {
    if (default_thread_count() < 3) return 0;  // built without OpenMP
    for (int k = 0; k < 30; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      std::atomic<int> begun = 0;
      parallel_for(shared->scheduler(), 3, [&](std::size_t /*task*/) {
        ++begun;
        while (begun < 3) std::this_thread::yield();  // until each thread has one
      });
    }
    return 0;
  });
}

TEST(FrameThreads, CallersShareTheHelpers) {
  const auto shared = threads_of(3);
  std::vector<std::thread> callers;
  for (int k = 0; k < 4; ++k) {
    callers.emplace_back([&] {
      test::with_threads(3, [&] {
        expect_all_run(shared->scheduler(), 20, 2000);
        return 0;
      });
    });
  }
  for (std::thread& caller : callers) caller.join();
}

TEST(FrameThreads, ALoopDoesNotWaitForHelpersThatAreBusy) {
  const auto shared = threads_of(2);
  test::with_threads(2, [&] {
    std::atomic<bool> is_done = false;
    // Both threads are in tasks that end only when the loop of another caller has.
    std::thread other;
    std::atomic<int> begun = 0;
    parallel_for(shared->scheduler(), 2, [&](std::size_t /*task*/) {
      if (++begun == 1) {
        other = std::thread([&] {
          expect_all_run(shared->scheduler(), 50, 1);
          is_done = true;
        });
      }
      while (!is_done) std::this_thread::yield();
    });
    other.join();
    return 0;
  });
}

TEST(FrameThreads, ALoopUsesNoMoreThreadsThanOpenMpWould) {
  const auto shared = threads_of(4);
  test::with_threads(1, [&] {
    const std::thread::id here = std::this_thread::get_id();
    for (int k = 0; k < 200; ++k) {
      parallel_for(shared->scheduler(), 20,
                   [&](std::size_t /*task*/) { EXPECT_EQ(std::this_thread::get_id(), here); });
    }
    return 0;
  });
}

TEST(FrameThreads, ALoopDoesNotAllocate) {
  const auto shared = threads_of(2);
  test::with_threads(2, [&] {
    std::atomic<int> sum = 0;
    EXPECT_EQ(test::count_allocations([&] {
                for (int k = 0; k < 100; ++k) {
                  parallel_for(shared->scheduler(), 10,
                               [&](std::size_t i) { sum += static_cast<int>(i); });
                }
              }),
              0);
    EXPECT_EQ(sum, 4500);
    return 0;
  });
}

TEST(FrameThreads, EndAsSoonAsTheyHaveBegun) {
  for (int k = 0; k < 200; ++k) threads_of(3);
}

}  // namespace
}  // namespace rebounce::test_frame_threads
