#include "transfer/data/opacity_maps.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rebounce::test_opacity_maps {
namespace {

constexpr double kThird = 1.0 / 3;

TEST(OpacityMaps, PlacesInAMicroTriangleAreFoundThere) {
  for (int level = 0; level <= OpacityMaps::kMaxLevel; ++level) {
    for (std::uint32_t micro = 0; micro < 1U << (2 * level); ++micro) {
      for (const TrianglePlace inside : {TrianglePlace{kThird, kThird}, TrianglePlace{0.05, 0.05},
                                         TrianglePlace{0.9, 0.05}, TrianglePlace{0.05, 0.9}}) {
        const auto [u, v] = place_in_micro_triangle(level, micro, inside);
        ASSERT_EQ(micro_triangle_at(level, static_cast<float>(u), static_cast<float>(v)), micro)
            << "level " << level;
      }
    }
  }
}

TEST(OpacityMaps, NeighboursInOrderAreNeighboursInPlace) {
  // No farther from the next than across the smallest quarter that holds both.
  constexpr int kLevel = 4;
  double longest = 0, sum = 0;
  for (std::uint32_t micro = 0; micro + 1 < 1U << (2 * kLevel); ++micro) {
    const auto a = place_in_micro_triangle(kLevel, micro, {kThird, kThird});
    const auto b = place_in_micro_triangle(kLevel, micro + 1, {kThird, kThird});
    const double distance = std::hypot(a.u - b.u, a.v - b.v);
    longest = std::max(longest, distance);
    sum += distance;
  }
  EXPECT_LT(longest, 1);
  EXPECT_LT(sum / 255, 0.12) << "a micro-triangle is 1/16 wide";
}

TEST(OpacityMaps, EveryFloatHasAPlace) {
  for (const float u : {-1.0F, 0.0F, 0.5F, 1.0F, 2.0F, NAN, INFINITY}) {
    for (const float v : {-1.0F, 0.0F, 0.5F, 1.0F, 2.0F, NAN, -INFINITY}) {
      EXPECT_LT(micro_triangle_at(OpacityMaps::kMaxLevel, u, v), 1024U);
    }
  }
}

TEST(OpacityMaps, StoppingPartIsTheMean) {
  const OpacityMaps maps{{1, kNone, 0}, {0, 1, 5}, {51, 0, 255, 0, 255}};
  EXPECT_DOUBLE_EQ(maps.stopping_part(0), 0.5);
  EXPECT_EQ(maps.stopping_part(1), 1);
  EXPECT_DOUBLE_EQ(maps.stopping_part(2), 0.2);
  EXPECT_EQ(OpacityMaps{}.stopping_part(7), 1);
}

TEST(OpacityMaps, SizesArePowersOfFour) {
  for (const std::size_t size : {1, 4, 16, 64, 256, 1024}) EXPECT_TRUE(is_opacity_map_size(size));
  for (const std::size_t size : {0, 2, 3, 8, 128, 512, 4096}) {
    EXPECT_FALSE(is_opacity_map_size(size)) << size;
  }
}

}  // namespace
}  // namespace rebounce::test_opacity_maps
