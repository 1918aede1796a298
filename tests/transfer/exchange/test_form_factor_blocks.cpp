// F in blocks, by rows and by its symmetric half, against plain rows.

#include "transfer/exchange/form_factor_blocks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "rebounce/error.h"
#include "tests/support/random_pairs.h"
#include "transfer/exchange/exchange_blocks.h"

namespace rebounce::test_form_factor_blocks {
namespace {

using test::expect_near_relative;
using test::Pairs;

template <typename Blocks>
class EveryBlocks : public testing::Test {};

using Forms = testing::Types<FormFactorBlocks, ExchangeBlocks>;
TYPED_TEST_SUITE(EveryBlocks, Forms);

TYPED_TEST(EveryBlocks, GatherWhatTheRowsGather) {
  for (const std::size_t n : {1, 2, 7, 8, 9, 255, 256, 257, 1000}) {
    const Pairs pairs(n);
    const TypeParam blocks(pairs.exchange, pairs.area);
    ASSERT_EQ(blocks.patch_count(), n);
    const std::vector<Float3> gathered = gather(blocks, pairs.light),
                              expected =
                                  gather(FormFactorRows(pairs.exchange, pairs.area), pairs.light);
    // Halves add up in partial sums.
    const double allowed = std::is_same_v<TypeParam, FormFactorBlocks> ? 3e-7 : 1e-6;
    for (std::size_t i = 0; i < n; ++i) expect_near_relative(gathered[i], expected[i], allowed);
  }
}

TYPED_TEST(EveryBlocks, WrongSizesAreRefused) {
  const Pairs pairs(9);
  const TypeParam blocks(pairs.exchange, pairs.area);
  std::vector<Float3> gathered(9);
  std::vector<float> workspace(blocks.workspace_size());
  const std::span<const Float3> light = pairs.light;
  EXPECT_THROW(blocks.gather(light.first(8), gathered, workspace), Error);
  EXPECT_THROW(blocks.gather(light, std::span(gathered).first(8), workspace), Error);
  EXPECT_THROW(blocks.gather(light, gathered, std::span(workspace).subspan(1)), Error);
  EXPECT_THROW(TypeParam(pairs.exchange, std::span(pairs.area).first(5)), Error);
}

/// Gauss-Seidel over plain rows. Returns the area-weighted square of the changes.
double relax(const FormFactorRows& rows, const RelaxationProblem& problem, SweepDirection direction,
             std::vector<Float3>& radiosity) {
  double changed_squared = 0;
  for (std::size_t k = 0; k < radiosity.size(); ++k) {
    const std::size_t i = direction == SweepDirection::kForward ? k : radiosity.size() - 1 - k;
    for (int c = 0; c < kChannelCount; ++c) {
      double arrived = 0;
      for (std::size_t e = 0; e < rows.columns(i).size(); ++e) {
        arrived += double{rows.form_factors(i)[e]} * radiosity[rows.columns(i)[e]][c];
      }
      const double next = problem.initial_exitance[i][c] + problem.reflectance[i][c] * arrived;
      changed_squared += problem.area[i] * std::pow(next - radiosity[i][c], 2);
      radiosity[i][c] = static_cast<float>(next);
    }
  }
  return changed_squared;
}

TYPED_TEST(EveryBlocks, SweepsAreThoseOfTheRowsInEveryOrderOfDirections) {
  constexpr auto kForward = SweepDirection::kForward, kBackward = SweepDirection::kBackward;
  for (const std::size_t n : {5, 256, 777}) {
    const Pairs pairs(n);
    const FormFactorRows rows(pairs.exchange, pairs.area);
    const TypeParam blocks(pairs.exchange, pairs.area);
    const std::vector<Float3> reflectance(n, {0.7F, 0.2F, 0.0F});
    const RelaxationProblem problem{pairs.area, reflectance, pairs.light};
    std::vector<Float3> expected(n, {1, 2, 3}), relaxed(n);
    const auto relaxation = blocks.make_relaxation();
    relaxation->begin(problem, expected);
    for (const SweepDirection direction :
         {kForward, kForward, kBackward, kForward, kBackward, kBackward}) {
      const double changed = relax(rows, problem, direction, expected);
      EXPECT_NEAR(relaxation->sweep(direction), changed, 1e-4 * changed + 1e-6);
      relaxation->end(relaxed);
      for (std::size_t i = 0; i < n; ++i) expect_near_relative(relaxed[i], expected[i], 2e-6);
    }
  }
}

TEST(FormFactorBlocks, TakeTheBytesOfFullBlocksAndTheirHalfHalfOfThem) {
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
  const FormFactorBlocks rows(exchange, area);
  EXPECT_EQ(rows.bytes(), kCount * kCount * 9 / 2 + (2 * kCount + 1) * 8);
  EXPECT_LT(static_cast<double>(ExchangeBlocks(exchange, area).bytes()),
            0.53 * static_cast<double>(rows.bytes()));
}

}  // namespace
}  // namespace rebounce::test_form_factor_blocks
