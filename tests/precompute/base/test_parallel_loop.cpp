#include "precompute/base/parallel_loop.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <vector>

namespace rebounce::test_parallel_loop {
namespace {

TEST(ParallelLoop, CallsEachIndexOnce) {
  std::vector<int> calls(1000, 0);
  parallel_loop(calls.size(), [&](std::size_t k) { ++calls[k]; });
  EXPECT_EQ(calls, std::vector<int>(1000, 1));
  parallel_loop(0, [](std::size_t) { FAIL(); });
}

TEST(ParallelLoop, ThrowsWhatACallThrowsAndLeavesOutTheRest) {
  std::atomic<int> calls = 0;
  const auto run = [&] {
    parallel_loop(100'000, [&](std::size_t) {
      ++calls;
      throw std::bad_alloc();
    });
  };
  EXPECT_THROW(run(), std::bad_alloc);
  EXPECT_GE(calls, 1);
  EXPECT_LT(calls, 100'000);
}

}  // namespace
}  // namespace rebounce::test_parallel_loop
