// A million frames of one engine.

#include <gtest/gtest.h>

#include "precompute/base/process_memory.h"
#include "tests/precompute/build/long_run.h"
#include "tests/support/built_scene.h"

namespace rebounce::test_long_run_large {
namespace {

constexpr std::size_t kFrames = 1000000, kMiB = 1 << 20;

TEST(LongRunLarge, AMillionFramesLeaveMemoryAndBitsAsTheyWere) {
  constexpr std::uint64_t kSeed = 2;
  BuildSettings settings;
  settings.subdivision.patch_count = 250;
  test::LongRun run(
      std::make_shared<const TransferData>(test::built_scene("furnished_room.gltf", settings)),
      kSeed);
  // The first crowd has come: its frames touch memory for as many lamps as there ever are.
  while (run.frames() < test::LongRun::kCompared) run.frame();
  const std::size_t before = resident_memory_bytes();
  while (run.frames() < kFrames) run.frame();
  const std::size_t after = resident_memory_bytes();
  std::printf("resident: %zu KiB after %zu frames, %zu KiB after %zu\n", before / 1024,
              test::LongRun::kCompared, after / 1024, kFrames);
  run.print_times();
  std::printf("%zu frames seemed slow and were repeated; largest/median %.1f\n", run.repeated(),
              run.largest_over_median());
  EXPECT_EQ(run.compared(), kFrames / test::LongRun::kCompared) << "seed " << kSeed;
  EXPECT_EQ(run.different(), 0) << "seed " << kSeed;
  EXPECT_GT(run.refused(), 1000) << "seed " << kSeed;
  EXPECT_EQ(run.mistaken(), 0) << "seed " << kSeed;
  EXPECT_EQ(run.crowded(), 20 * kFrames / 5000) << "seed " << kSeed;
  EXPECT_EQ(run.allocations(), 0) << "seed " << kSeed;
  EXPECT_LT(after, before + 2 * kMiB);
  EXPECT_LT(run.largest_over_median(), 10);
}

}  // namespace
}  // namespace rebounce::test_long_run_large
