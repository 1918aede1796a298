#include "precompute/base/parallel_loop.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <atomic>
#include <new>
#include <numeric>
#include <set>
#include <vector>

#include "precompute/base/scratch_pool.h"

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

TEST(ParallelLoop, MakesAScratchOnceForEachThread) {
  std::atomic<int> made = 0;
  std::vector<int> calls(1000, 0), scratches(1000, 0);
  parallel_loop(
      calls.size(), 16,
      [&] {
        return std::vector<int>{made++, 0};
      },
      [&](std::size_t k, std::vector<int>& scratch) {
        ++calls[k];
        scratches[scratch[0]] = ++scratch[1];
      });
  EXPECT_EQ(calls, std::vector<int>(1000, 1));
  EXPECT_GE(made, 1);
  EXPECT_LE(made, omp_get_max_threads());
  EXPECT_EQ(std::accumulate(scratches.begin(), scratches.end(), 0), 1000);
  parallel_loop(
      0, 16, [&] { return ++made; }, [](std::size_t, int) { FAIL(); });
}

TEST(ParallelLoop, ThrowsWhatAScratchThrows) {
  const auto make = []() -> int { throw std::bad_alloc(); };
  const auto run = [&] { parallel_loop(100, 4, make, [](std::size_t, int) { FAIL(); }); };
  EXPECT_THROW(run(), std::bad_alloc);
}

TEST(ScratchPool, LendsEachToOneThreadAndKeepsWhatComesBack) {
  ScratchPool<std::vector<int>> pool;
  std::set<const std::vector<int>*> seen;
  for (int loop = 0; loop < 10; ++loop) {
    parallel_loop(
        100, 1, [&] { return pool.lend(); },
        [&](std::size_t, const auto& scratch) {
          scratch->push_back(0);
#pragma omp critical
          seen.insert(scratch.get());
        });
  }
  EXPECT_LE(seen.size(), static_cast<std::size_t>(omp_get_max_threads()));
  std::size_t used = 0;
  std::vector<ScratchPool<std::vector<int>>::Loan> loans;
  for (std::size_t k = 0; k < seen.size(); ++k) used += loans.emplace_back(pool.lend())->size();
  EXPECT_EQ(used, 1000);
  EXPECT_TRUE(pool.lend()->empty());
}

}  // namespace
}  // namespace rebounce::test_parallel_loop
