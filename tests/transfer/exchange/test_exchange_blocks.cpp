// F by its symmetric half against F by rows.

#include "transfer/exchange/exchange_blocks.h"

#include <gtest/gtest.h>

#include "rebounce/error.h"
#include "tests/support/random_pairs.h"

namespace rebounce::test_exchange_blocks {
namespace {

using test::expect_near;
using test::Pairs;

TEST(ExchangeBlocks, GathersWhatTheRowsGather) {
  for (const std::size_t n : {1, 2, 7, 8, 9, 255, 256, 257, 1000}) {
    const Pairs pairs(n);
    const FormFactorRows rows(pairs.exchange, pairs.area);
    const ExchangeBlocks blocks(pairs.exchange, pairs.area);
    std::vector<Float3> expected(n), gathered(n);
    std::vector<float> workspace(blocks.workspace_size());
    rows.gather(pairs.light, expected);
    blocks.gather(pairs.light, gathered, workspace);
    for (std::size_t i = 0; i < n; ++i) expect_near(gathered[i], expected[i], 1e-6);
  }
}

TEST(ExchangeBlocks, WrongSizesAreRefused) {
  const Pairs pairs(9);
  const ExchangeBlocks blocks(pairs.exchange, pairs.area);
  std::vector<Float3> gathered(9);
  std::vector<float> workspace(blocks.workspace_size());
  const std::span<const Float3> light = pairs.light;
  EXPECT_THROW(blocks.gather(light.first(8), gathered, workspace), Error);
  EXPECT_THROW(blocks.gather(light, std::span(gathered).first(8), workspace), Error);
  EXPECT_THROW(blocks.gather(light, gathered, std::span(workspace).subspan(1)), Error);
}

TEST(ExchangeBlocks, SweepsAreThoseOfTheRowsInEveryOrderOfDirections) {
  constexpr auto kForward = SweepDirection::kForward, kBackward = SweepDirection::kBackward;
  for (const std::size_t n : {5, 256, 777}) {
    const Pairs pairs(n);
    const FormFactorRows rows(pairs.exchange, pairs.area);
    const ExchangeBlocks blocks(pairs.exchange, pairs.area);
    const std::vector<Float3> reflectance(n, {0.7F, 0.2F, 0.0F}), start(n, {1, 2, 3});
    const RelaxationProblem problem{pairs.area, reflectance, pairs.light};
    const auto by_rows = rows.make_relaxation(), by_half = blocks.make_relaxation();
    by_rows->begin(problem, start);
    by_half->begin(problem, start);
    std::vector<Float3> expected(n), relaxed(n);
    for (const SweepDirection direction :
         {kForward, kForward, kBackward, kForward, kBackward, kBackward}) {
      const double changed = by_rows->sweep(direction);
      EXPECT_NEAR(by_half->sweep(direction), changed, 1e-4 * changed + 1e-6);
      by_rows->end(expected);
      by_half->end(relaxed);
      for (std::size_t i = 0; i < n; ++i) expect_near(relaxed[i], expected[i], 2e-6);
    }
  }
}

TEST(ExchangeBlocks, AreHalfTheBytesOfTheRows) {
  constexpr std::size_t kCount = 512;  // each sees each
  std::vector<std::uint64_t> begin = {0};
  std::vector<std::uint32_t> column;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    for (std::uint32_t j = i + 1; j < kCount; ++j) column.push_back(j);
    begin.push_back(column.size());
  }
  std::vector<float> value(column.size(), 1.0F / kCount);
  const ExchangeMatrix exchange{SharedArray(std::move(begin)), SharedArray(std::move(column)),
                                SharedArray(std::move(value))};
  const std::vector<float> area(kCount, 1.0F);
  const ExchangeBlocks half(exchange, area);
  const FormFactorBlocks rows(exchange, area);
  EXPECT_LT(static_cast<double>(half.bytes()), 0.53 * static_cast<double>(rows.bytes()));
  EXPECT_THROW(ExchangeBlocks(exchange, std::span(area).first(5)), Error);
}

}  // namespace
}  // namespace rebounce::test_exchange_blocks
