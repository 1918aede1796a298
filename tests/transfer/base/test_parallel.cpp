#include "transfer/base/parallel.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/allocation_counter.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/random_light.h"
#include "tests/support/random_pairs.h"
#include "tests/support/thread_pool.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce::test_parallel {
namespace {

constexpr std::size_t kPatchCount = 2500;  // several tasks in each loop

TEST(Parallel, EachTaskRunsOnceAndLoopsFollowEachOther) {
  test::ThreadPool pool(3);
  for (const Scheduler& scheduler : {Scheduler{}, pool.scheduler()}) {
    std::vector<int> first(1000, 0), second(1000, 0);
    int between = 0;
    const auto fill = [&](std::size_t k) { ++first[k]; };
    const auto add = [&](std::size_t) { between = std::accumulate(first.begin(), first.end(), 0); };
    const auto copy = [&](std::size_t k) { second[k] += between; };
    const int count = test::count_allocations([&] {
      run_in_turn(scheduler, {{first.size(), fill},
                              {0, add},
                              {1, add},
                              {piece_count(second.size(), 7), on_piece(second.size(), 7, copy)}});
    });
    EXPECT_EQ(first, std::vector<int>(1000, 1));
    EXPECT_EQ(second, std::vector<int>(1000, 1000));
    EXPECT_TRUE(count == 0 || scheduler.parallel_for == nullptr) << count;
  }
  EXPECT_EQ(pool.loop_count(), 2) << "not for loops of one task or none";
}

/// `work`(scheduler, result) on a pool and by default.
template <typename Work>
void compare(const Work& work) {
  test::ThreadPool pool(3);
  std::vector<Float3> usual(kPatchCount), pooled(kPatchCount);
  work(Scheduler{}, std::span(usual));
  EXPECT_EQ(test::count_allocations([&] { work(pool.scheduler(), std::span(pooled)); }), 0);
  EXPECT_EQ(usual, pooled);
  EXPECT_GT(pool.loop_count(), 0);
}

void expect_same_bits(const TransferOperator& op) {
  const std::vector<Float3> light = test::random_light(op.patch_count(), 1);
  std::vector<float> workspace(op.workspace_size());
  compare([&](const Scheduler& scheduler, std::span<Float3> result) {
    op.apply(light, result, workspace, scheduler);
  });
}

void expect_same_bits(const FormFactorOperator& form_factors) {
  const std::vector<Float3> light = test::random_light(form_factors.patch_count(), 1);
  std::vector<float> workspace(form_factors.workspace_size());
  compare([&](const Scheduler& scheduler, std::span<Float3> result) {
    form_factors.gather(light, result, workspace, scheduler);
  });
}

TEST(Parallel, HierarchicalOperatorsHaveTheSameBits) {
  for (const bool nested : {false, true}) {
    for (const std::uint32_t matrix_count : {1U, 3U}) {
      expect_same_bits(HierarchicalOperator(
          test::RandomHierarchicalStorage(kPatchCount, matrix_count, 4, nested).storage));
    }
  }
}

std::vector<float> random_values(std::size_t count) {
  std::vector<float> values;
  for (const Float3& v : test::random_light(count, 9)) values.push_back(v[0]);
  return values;
}

TEST(Parallel, DenseOperatorsHaveTheSameBits) {
  DenseOperator::Storage dense;
  dense.area.assign(kPatchCount, 0.5F);
  dense.matrix_count = 1;
  constexpr std::size_t kTileSize = DenseOperator::kTile * DenseOperator::kTile;
  dense.tiles_f32 = SharedArray(random_values(DenseOperator::tile_count(kPatchCount) * kTileSize));
  expect_same_bits(DenseOperator(std::move(dense)));
}

TEST(Parallel, FormFactorsByPairsHaveTheSameBits) {
  const test::Pairs pairs(kPatchCount);
  expect_same_bits(FormFactorRows(pairs.exchange, pairs.area));
  expect_same_bits(ExchangeBlocks(pairs.exchange, pairs.area));
}

TEST(Parallel, LinksHaveTheSameBits) {
  FormFactorLinks links;
  links.patch.resize(kPatchCount);
  std::iota(links.patch.begin(), links.patch.end(), 0U);
  links.scale.assign(kPatchCount, 0.9F);
  links.count = {static_cast<std::uint32_t>(kPatchCount)};
  for (std::size_t k = 0; k < links.count.size(); ++k) {
    const std::uint32_t count = links.count[k];
    links.first_child.push_back(count == 1 ? kNone
                                           : static_cast<std::uint32_t>(links.count.size()));
    if (count > 1) links.count.insert(links.count.end(), {count / 2, count - count / 2});
  }
  for (std::uint32_t a = 1; a < links.count.size(); ++a) {
    for (const std::uint32_t step : {1U, 17U, 801U}) {
      links.pair.push_back({a, (a + step) % static_cast<std::uint32_t>(links.count.size())});
    }
  }
  links.exchange_area = random_values(links.pair.size());
  links.gradient.assign(links.pair.size(), {0.1F, 0.2F, 0.3F, -0.1F, 0, 0.1F});
  expect_same_bits(LinkedFormFactors(links, std::vector<float>(kPatchCount, 0.5F),
                                     test::random_light(kPatchCount, 3)));
}

}  // namespace
}  // namespace rebounce::test_parallel
