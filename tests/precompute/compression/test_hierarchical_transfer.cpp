// The compressed operator against the dense one that it is made from.

#include "precompute/compression/hierarchical_transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rebounce/error.h"
#include "tests/support/solved_room.h"
#include "tests/support/unshadowed_lights.h"
#include "tests/support/with_threads.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce::test_hierarchical_transfer {
namespace {

using Room = test::SolvedRoom;

/// Coloured walls, a black block, another colour.
const Room& furnished_room() {
  static const Room room(test::furnished_room({0.7F, 0.5F, 0.2F}, {0, 0, 0}, {0.1F, 0.3F, 0.9F}),
                         900);
  return room;
}

/// Of lights in the free upper part of the room.
std::vector<std::vector<Float3>> lights_in(const PatchTable& patches, int count,
                                           std::uint64_t seed) {
  return test::unshadowed_lights(patches, count, seed, 2.2, 0.7);
}

double entry_error(const DenseOperator& dense, const TransferOperator& transfer) {
  const std::size_t n = dense.patch_count();
  std::vector<float> a(n * n), b(n * n);
  double error = 0, norm = 0;
  for (int c = 0; c < kChannelCount; ++c) {
    dense.expand(c, a);
    transfer.expand(c, b);
    for (std::size_t k = 0; k < a.size(); ++k) {
      error += std::pow(static_cast<double>(a[k]) - b[k], 2);
      norm += std::pow(static_cast<double>(a[k]), 2);
    }
  }
  return std::sqrt(error / norm);
}

TEST(HierarchicalTransfer, KeepsEveryTolerance) {
  const Room& room = furnished_room();
  const auto probes = lights_in(room.patches, 12, 1), judges = lights_in(room.patches, 12, 3),
             others = lights_in(room.patches, 24, 2);
  double previous_error = 1;
  std::size_t previous_bytes = 0;
  for (const double tolerance : {0.04, 0.01, 0.002}) {
    const auto transfer = build_hierarchical_transfer(*room.dense, room.patches, {probes, judges},
                                                      {.tolerance = tolerance});
    const double error = room.mean_error(*transfer, others);
    // Under lights that the build has not seen.
    EXPECT_LT(error, tolerance);
    EXPECT_GT(error, 0.2 * tolerance) << "bytes are wasted";
    EXPECT_LT(error, previous_error);
    EXPECT_GT(transfer->bytes(), previous_bytes);
    EXPECT_LT(transfer->bytes(), room.dense->bytes() / 4);
    previous_error = error;
    previous_bytes = transfer->bytes();
  }
}

TEST(HierarchicalTransfer, SaysWhatItMissesByItsError) {
  // Half precision cannot do this: the best that it can must come back, not nothing.
  const Room& room = furnished_room();
  const auto probes = lights_in(room.patches, 4, 1);
  const auto transfer =
      build_hierarchical_transfer(*room.dense, room.patches, {probes, probes}, {.tolerance = 1e-6});
  const double error = room.mean_error(*transfer, probes);
  EXPECT_GT(error, 1e-6);
  EXPECT_LT(error, 1e-3);
}

TEST(HierarchicalTransfer, NearlyEverythingIsExactAtALowMultiplier) {
  const Room& room = furnished_room();
  const HierarchicalOperator transfer(
      compress_transfer(*room.dense, room.patches, lights_in(room.patches, 16, 1), 1e-16));
  EXPECT_LT(entry_error(*room.dense, transfer), 1e-5);
}

TEST(HierarchicalTransfer, EveryPairOfPositionsIsInOneBlock) {
  const Room& room = furnished_room();
  for (const double multiplier : {1e-5, 1e-9}) {
    const HierarchicalOperator transfer(
        compress_transfer(*room.dense, room.patches, lights_in(room.patches, 16, 1), multiplier));
    const std::size_t positions =
        HierarchicalFormat::position_count(room.patches.size()) / HierarchicalFormat::kAlignment;
    std::vector<int> covered(positions * positions, 0);
    for (const TransferBlock& block : transfer.storage().blocks) {
      for (std::size_t i = 0; i < block.row_count / HierarchicalFormat::kAlignment; ++i) {
        for (std::size_t j = 0; j < block.column_count / HierarchicalFormat::kAlignment; ++j) {
          const std::size_t row = block.row_begin / HierarchicalFormat::kAlignment + i;
          const std::size_t column = block.column_begin / HierarchicalFormat::kAlignment + j;
          ++covered[row * positions + column];
          if (!block.on_diagonal()) ++covered[column * positions + row];
        }
      }
    }
    EXPECT_TRUE(std::ranges::all_of(covered, [](int count) { return count == 1; }));
  }
}

TEST(HierarchicalTransfer, SameBitsForAnyNumberOfThreads) {
  const Room& room = furnished_room();
  const auto make = [&] {
    return compress_transfer(*room.dense, room.patches, lights_in(room.patches, 16, 1), 1e-7);
  };
  const auto one = test::with_threads(1, make), four = test::with_threads(4, make);
  EXPECT_TRUE(std::ranges::equal(one.values_f32, four.values_f32));
  EXPECT_EQ(one.patch, four.patch);
}

TEST(HierarchicalTransfer, BlackLampsAreCarriedWhereTheyAreNamed) {
  // No lamp's light leaves black patches, so that nothing else says that they matter.
  const Room& room = furnished_room();
  std::vector<Float3> light(room.patches.size());
  int black = 0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (room.patches.reflectance[i] != Float3{0, 0, 0}) continue;
    light[i] = {1, 1, 1};
    ++black;
  }
  ASSERT_GT(black, 20);
  auto lights = lights_in(room.patches, 12, 1);
  lights.push_back(light);
  constexpr double kTolerance = 0.01;
  const auto transfer = build_hierarchical_transfer(*room.dense, room.patches, {lights, lights},
                                                    {.tolerance = kTolerance});
  EXPECT_LT(room.mean_error(*transfer, {&light, 1}), 3 * kTolerance);
}

TEST(HierarchicalTransfer, AGreyRoomStoresItsMatrixOnce) {
  constexpr Float3 kGrey = {0.6F, 0.6F, 0.6F};
  const Room room(test::furnished_room(kGrey, {0, 0, 0}, kGrey), 500);
  const HierarchicalOperator grey(
      compress_transfer(*room.dense, room.patches, lights_in(room.patches, 16, 1), 1e-7));
  EXPECT_EQ(grey.storage().matrix_count, 1U);
  // The same matrix three times over has the same bases, thrice the coupling matrices and dense
  // blocks.
  DenseOperator::Storage thrice = room.dense->storage();
  std::vector<float> tiles;
  for (int c = 0; c < kChannelCount; ++c) {
    tiles.insert(tiles.end(), thrice.tiles_f32.begin(), thrice.tiles_f32.end());
  }
  thrice.tiles_f32 = SharedArray(std::move(tiles));
  thrice.matrix_count = 3;
  thrice.channel_matrix = {0, 1, 2};
  const HierarchicalOperator rgb(compress_transfer(DenseOperator(thrice), room.patches,
                                                   lights_in(room.patches, 16, 1), 3 * 1e-7));
  EXPECT_EQ(rgb.storage().matrix_count, 3U);
  EXPECT_LT(grey.bytes(), rgb.bytes());
}

TEST(HierarchicalTransfer, TheBrightestRoomFitsHalfPrecision) {
  // Light is reflected a hundred times, and a coarse operator has it all in few, large coupling
  // matrices.
  for (const float reflectance : {0.9F, 0.99F}) {
    Scene scene = test::empty_scene({reflectance, reflectance, reflectance});
    test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true, 0);
    const Room room(scene, 300);
    const auto lights = lights_in(room.patches, 12, 1);
    for (const Precision precision : {Precision::kF16, Precision::kQ8}) {
      const auto transfer = build_hierarchical_transfer(
          *room.dense, room.patches, {lights, lights}, {.tolerance = 0.03, .precision = precision});
      EXPECT_LT(room.mean_error(*transfer, lights), 0.03);
      EXPECT_LT(transfer->bytes(), room.dense->bytes() / 4);
    }
  }
}

TEST(HierarchicalTransfer, TakesOnePatchAndNoLights) {
  PatchTable patches;
  patches.area = {2};
  patches.centroid = {{0, 0, 0}};
  patches.normal = {{0, 1, 0}};
  patches.reflectance = {{0.5F, 0.5F, 0.5F}};
  const ExchangeMatrix exchange{SharedArray(std::vector<std::uint64_t>(2)), {}, {}};
  const auto dense = build_dense_transfer(exchange, patches, Precision::kF32);
  const auto transfer = build_hierarchical_transfer(*dense, patches, {}, {});
  EXPECT_EQ(product(*transfer, std::vector<Float3>{{1, 1, 1}})[0], (Float3{0, 0, 0}));
}

TEST(HierarchicalTransfer, StopsWhenAsked) {
  const Room& room = furnished_room();
  EXPECT_THROW(compress_transfer(*room.dense, room.patches, lights_in(room.patches, 16, 1), 1e-7,
                                 [](double) { return false; }),
               Cancelled);
}

}  // namespace
}  // namespace rebounce::test_hierarchical_transfer
