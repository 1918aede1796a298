// A few thousand frames of one engine; test_long_run_large.cpp has a million.

#include <gtest/gtest.h>

#include "tests/precompute/build/long_run.h"
#include "tests/support/built_scene.h"

namespace rebounce::test_long_run {
namespace {

TEST(LongRun, FramesStayThoseOfAFreshEngine) {
  constexpr std::uint64_t kSeed = 1;
  test::LongRun run(std::make_shared<const TransferData>(
                        test::built_scene("furnished_room.gltf", test::quick_settings(250))),
                    kSeed);
  while (run.frames() < 6000) run.frame();
  EXPECT_EQ(run.compared(), 6) << "seed " << kSeed;
  EXPECT_EQ(run.different(), 0) << "seed " << kSeed;
  EXPECT_GT(run.refused(), 3) << "seed " << kSeed;
  EXPECT_EQ(run.mistaken(), 0) << "seed " << kSeed;
  EXPECT_EQ(run.crowded(), 40) << "seed " << kSeed;
  EXPECT_EQ(run.allocations(), 0) << "seed " << kSeed;
}

}  // namespace
}  // namespace rebounce::test_long_run
