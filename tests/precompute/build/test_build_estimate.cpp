// The memory that builds are said to need, and are refused for.

#include "precompute/build/build_estimate.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "precompute/base/process_memory.h"
#include "precompute/lights/fitting_lights.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_build_estimate {
namespace {

constexpr std::uint64_t kPlenty = 1ULL << 40;

BuildSettings settings_of(OperatorKind kind) {
  BuildSettings settings;
  settings.operator_kind = kind;
  settings.rank = 256;
  return settings;
}

TEST(BuildEstimate, OfPairsHoldsTheirArraysOfEveryKind) {
  // Half of all pairs: of 16 bytes in rows and 8 in the matrix, or of 8 in the matrix beside the
  // inverse.
  constexpr std::size_t kPatches = 4096, kPairs = kPatches * kPatches / 4;
  EXPECT_GE(peak_bytes_of_pairs(pairs_build({kPatches}, 3, settings_of(OperatorKind::kNoOperator))),
            (16 + 8) * kPairs);
  for (const OperatorKind kind :
       {OperatorKind::kDense, OperatorKind::kHierarchical, OperatorKind::kLowRank}) {
    const bool dense = kind == OperatorKind::kDense;
    for (const std::size_t matrices : {1U, 3U}) {
      // Triangles of the operator in floats and of the system, in doubles if the operator is exact.
      const std::size_t triangles = 2 * kPairs * (4 * matrices + (dense ? 8 : 4));
      const std::uint64_t bytes =
          peak_bytes_of_pairs(pairs_build({kPatches}, matrices, settings_of(kind)));
      // In small scenes the lights that a hierarchical operator is fitted to take the most.
      if (kind == OperatorKind::kHierarchical) {
        EXPECT_GE(bytes, 2 * kPairs * 4 * matrices + kPatches * kFittingLightBytes);
      }
      EXPECT_GE(bytes, 8 * kPairs + triangles);
      // What the process holds counts too: with sanitizers more than all of it.
      EXPECT_LE(bytes, resident_memory_bytes() + 2 * ((8 + 2 * 8) * kPairs + triangles));
    }
  }
}

TEST(BuildEstimate, OfLinksHoldsTheirArrays) {
  const LinkedBuild build{.scene = {64000}, .link_count = 25'000'000, .matrix_count = 3};
  // As they are refined, and copied; then 36 bytes each in the file's arrays, and 20 at both nodes.
  EXPECT_GE(peak_bytes_of_links(build), (44 + 36) * build.link_count);
  EXPECT_GE(peak_bytes_after_links(build, kPlenty), (36 + 2 * 20) * build.link_count);
}

TEST(BuildEstimate, TakesTheMemoryThatIsLeft) {
  const LinkedBuild build{.scene = {64000}, .link_count = 20'000'000, .matrix_count = 3};
  const int before = omp_get_max_threads();
  omp_set_num_threads(8);
  const std::uint64_t free = peak_bytes_after_links(build, kPlenty),
                      least = peak_bytes_after_links(build, 1),
                      between = peak_bytes_after_links(build, (free + least) / 2);
  EXPECT_EQ(thread_count_after_links(build, kPlenty), 8);
  EXPECT_EQ(thread_count_after_links(build, 1), 1);
  const int some = thread_count_after_links(build, (free + least) / 2);
  EXPECT_TRUE(some > 1 && some < 8) << some;
  omp_set_num_threads(before);
  EXPECT_LT(least, between);
  EXPECT_LE(between, (free + least) / 2);
  EXPECT_LT(between, free);
  EXPECT_EQ(memory_of_matrix_free_transfer(build, 1), 1U);
  EXPECT_EQ(memory_of_matrix_free_transfer(build, kPlenty) + 1,
            memory_of_matrix_free_transfer(build, kPlenty + 1));
}

TEST(BuildEstimate, GrowsWithEverythingAndFallsWithReceiversAndSources) {
  const LinkedBuild build{.scene = {30000}, .link_count = 5'000'000, .matrix_count = 2};
  const auto bytes = [](const LinkedBuild& b) { return peak_bytes_after_links(b, kPlenty); };
  LinkedBuild larger = build, denser = build, coloured = build, finer = build, part = build;
  larger.scene.patch_count *= 2;
  denser.link_count *= 2;
  coloured.matrix_count = 3;
  finer.tolerance /= 5;
  for (const LinkedBuild& other : {larger, denser, coloured, finer}) {
    EXPECT_GT(bytes(other), bytes(build));
  }
  part.roles.role.assign(build.scene.patch_count, 0);
  std::fill_n(part.roles.role.begin(), 10000, PatchRoles::kBoth);
  EXPECT_LT(bytes(part), bytes(build));
  const CostEstimate estimate = estimate_after_links(part, kPlenty);
  EXPECT_EQ(estimate.receiver_count, 10000U);
  EXPECT_EQ(estimate.source_count, 10000U);
  EXPECT_EQ(estimate.link_count, part.link_count);
  EXPECT_EQ(estimate.peak_bytes, bytes(part));
  LinkedBuild beside = part;
  beside.held_bytes = 1000;
  EXPECT_EQ(bytes(beside), bytes(part) + 1000);
}

TEST(BuildEstimate, LinksThatAreMadeFinerAreMore) {
  EXPECT_GT(finer_link_count(1000000, 2000), 1000000U);
  EXPECT_GT(finer_link_count(1000000, 8000), finer_link_count(1000000, 2000));
  EXPECT_EQ(finer_link_count(1000000, 64000), finer_link_count(1000000, 16000));
  EXPECT_LT(finer_link_count(1000000, 1000000), 2000000U);
}

TEST(BuildEstimate, HoldsWhatTheBuildHasTakenAlready) {
  constexpr std::uint64_t kMiB = 1 << 20;  // the kernel counts the two apart
  const std::uint64_t peak = peak_memory_bytes();
  ASSERT_GE(peak + kMiB, resident_memory_bytes());
  const TakenMemory taken;
  EXPECT_EQ(taken.bytes(), 0U);
  const std::vector<char> more(peak + 2 * kMiB, 1);  // touched
  EXPECT_GE(taken.bytes(), more.size());
}

TEST(BuildEstimate, RowsOfReceiversAreAStageOfTheirOwn) {
  constexpr std::size_t kPatches = 1000;
  const auto bytes = [](std::uint64_t rows) {
    return peak_bytes_of_pairs(pairs_build({.patch_count = kPatches, .row_bytes = rows}, 1,
                                           settings_of(OperatorKind::kDense)));
  };
  constexpr std::uint64_t kFew = 1000, kMany = 1ULL << 30;
  EXPECT_NEAR(static_cast<double>(bytes(kFew)), static_cast<double>(bytes(0)), 1e6);
  EXPECT_GE(bytes(kMany), kMany);
  EXPECT_LE(bytes(kMany), bytes(0) + kMany);
}

TEST(BuildEstimate, OfPatchesIsKnownBeforeTheyAreMade) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  const auto count_of = [&](const SubdivisionSettings& settings) {
    return least_cost(scene, settings).patch_count;
  };
  const double area = 2 * (4 * 3 + 3 * 5 + 5 * 4);
  EXPECT_EQ(count_of({.patch_count = 0, .patch_size = 8}), 0U) << "nothing is cut";
  EXPECT_NEAR(static_cast<double>(count_of({.patch_count = 0, .patch_size = 0.25F})),
              2 * area / 0.0625, 1);
  EXPECT_EQ(count_of({.patch_count = 1000, .patch_size = 0.25F}), 1000U);
  const PatchModel model = make_patch_model(scene, {.patch_count = 0, .patch_size = 0.25F});
  EXPECT_GE(model.patches.size(), count_of({.patch_count = 0, .patch_size = 0.25F}));
  EXPECT_LE(model.patches.size(), 4 * count_of({.patch_count = 0, .patch_size = 0.25F}));

  EXPECT_EQ(least_cost(scene, {.patch_count = kPairsPatchCount}).peak_bytes, 0U);
  EXPECT_GT(least_cost(scene, {.patch_count = 1'000'000}).peak_bytes, 10ULL << 30);
  for (const SubdivisionSettings& endless :
       {SubdivisionSettings{.patch_count = std::numeric_limits<std::size_t>::max()},
        SubdivisionSettings{.patch_count = 0, .patch_size = 1e-40F}}) {
    EXPECT_GT(least_cost(scene, endless).peak_bytes, 1ULL << 60);
  }
}

TEST(BuildEstimate, IsRefusedAboveTheLimit) {
  CostEstimate estimate;
  estimate.patch_count = 64000;
  estimate.peak_bytes = 3ULL << 30;
  refuse_if_too_large(estimate, estimate.peak_bytes, 12);
  test::expect_error([&] { refuse_if_too_large(estimate, estimate.peak_bytes - 1, 12); },
                     "64000 patches (from 12 triangles) need about 3 GiB, the limit is 3 GiB");
}

}  // namespace
}  // namespace rebounce::test_build_estimate
