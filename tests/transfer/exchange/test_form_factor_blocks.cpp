// F in blocks against F by rows.

#include "transfer/exchange/form_factor_blocks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rebounce/error.h"
#include "tests/support/random_pairs.h"

namespace rebounce::test_form_factor_blocks {
namespace {

using test::expect_near;
using test::Pairs;

TEST(FormFactorBlocks, GathersWhatTheRowsGather) {
  for (const std::size_t n : {1, 2, 7, 8, 9, 255, 256, 257, 1000}) {
    const Pairs pairs(n);
    const FormFactorRows rows(pairs.exchange, pairs.area);
    const FormFactorBlocks blocks(rows);
    ASSERT_EQ(blocks.patch_count(), n);
    std::vector<Float3> expected(n), gathered(n);
    std::vector<float> workspace(blocks.workspace_size());
    rows.gather(pairs.light, expected);
    blocks.gather(pairs.light, gathered, workspace);
    std::vector<float> planes(kChannelCount * blocks.plane_size());
    blocks.to_planes(pairs.light, planes);
    for (std::size_t i = 0; i < n; ++i) {
      expect_near(gathered[i], expected[i], 3e-7);
      const Float3 inside = blocks.gather_inside_group(i, planes),
                   outside = blocks.gather_outside_group(i, planes);
      expect_near({inside[0] + outside[0], inside[1] + outside[1], inside[2] + outside[2]},
                  expected[i], 3e-7);
    }
  }
}

TEST(FormFactorBlocks, AGroupGathersFromItselfOnly) {
  const Pairs pairs(1000);
  const FormFactorBlocks blocks(pairs.exchange, pairs.area);
  std::vector<Float3> light(1000, {0, 0, 0});
  constexpr std::size_t kGroup = FormFactorBlocks::kGroup;
  std::fill_n(light.begin() + kGroup, kGroup, Float3{1, 1, 1});
  std::vector<float> planes(kChannelCount * blocks.plane_size());
  blocks.to_planes(light, planes);
  double inside = 0;
  for (std::size_t i = 0; i < 1000; ++i) {
    const bool member = i / kGroup == 1;
    const Float3 nothing =
        member ? blocks.gather_outside_group(i, planes) : blocks.gather_inside_group(i, planes);
    EXPECT_EQ(nothing[0], 0);
    inside += blocks.gather_inside_group(i, planes)[0];
  }
  EXPECT_GT(inside, 0);
}

TEST(FormFactorBlocks, PlanesGoThereAndBack) {
  const Pairs pairs(77);
  const FormFactorBlocks blocks(pairs.exchange, pairs.area);
  std::vector<float> planes(kChannelCount * blocks.plane_size(), -1.0F);
  std::vector<Float3> back(77);
  blocks.to_planes(pairs.light, planes);
  blocks.from_planes(planes, back);
  EXPECT_EQ(back, pairs.light);
  EXPECT_EQ(planes[77], 0);  // past the last patch
}

TEST(FormFactorBlocks, CountsItsBytes) {
  const Pairs pairs(512);
  const FormFactorBlocks blocks(pairs.exchange, pairs.area);
  EXPECT_GT(blocks.fill(), 0.3);
  EXPECT_LE(blocks.fill(), 1);
  const double slots = 2 * static_cast<double>(pairs.exchange.column.size()) / blocks.fill();
  EXPECT_NEAR(static_cast<double>(blocks.bytes()), slots * 4.5 + (512 + 513) * 8, 1);
  EXPECT_THROW(FormFactorBlocks(pairs.exchange, std::span(pairs.area).first(5)), Error);
}

}  // namespace
}  // namespace rebounce::test_form_factor_blocks
