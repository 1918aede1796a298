// What a build from links is said to take, against builds that were measured.

#include "build_estimate.h"

#include <gtest/gtest.h>
#include <omp.h>

#include "expect_error.h"

namespace rebounce {
namespace {

constexpr std::uint64_t kPlenty = 1ULL << 40;

/// Of one processor, whatever this machine has.
double processor_seconds(const CostEstimate& estimate) {
  return estimate.seconds * omp_get_max_threads();
}

struct Measured {
  const char* scene;
  LinkedBuild build;
  double links, rest;  ///< processor seconds; notes/links.md, notes/operator.md
};

const Measured kMeasured[] = {
    {"white room", {.patch_count = 4000, .link_count = 188'190, .matrix_count = 1}, 4.2, 22.8},
    {"white room", {.patch_count = 64000, .link_count = 2'900'000, .matrix_count = 1}, 86, 1606},
    {"white room", {.patch_count = 12000, .link_count = 496'530, .matrix_count = 1}, 13.2, 98.3},
    {"furnished room", {.patch_count = 4000, .link_count = 663'316, .matrix_count = 3}, 13.1, 65.7},
};

TEST(BuildEstimate, IsThatOfMeasuredBuildsOnceLinksAreKnown) {
  for (const Measured& measured : kMeasured) {
    SCOPED_TRACE(measured.scene);
    const double links = processor_seconds(estimate_links(measured.build));
    const double rest = processor_seconds(estimate_operator_from_links(measured.build, kPlenty));
    EXPECT_LT(links, 1.5 * measured.links);
    EXPECT_GT(links, measured.links / 1.5);
    EXPECT_LT(rest, 1.5 * measured.rest);
    EXPECT_GT(rest, measured.rest / 1.5);
  }
}

TEST(BuildEstimate, TakesTheMemoryThatIsLeft) {
  const LinkedBuild build{.patch_count = 64000, .link_count = 20'000'000, .matrix_count = 3};
  const int before = omp_get_max_threads();
  omp_set_num_threads(8);
  const CostEstimate free = estimate_operator_from_links(build, kPlenty),
                     least = estimate_operator_from_links(build, 1),
                     between = estimate_operator_from_links(
                         build, (free.peak_bytes + least.peak_bytes) / 2);
  omp_set_num_threads(before);
  EXPECT_LT(least.peak_bytes, between.peak_bytes);
  EXPECT_LE(between.peak_bytes, (free.peak_bytes + least.peak_bytes) / 2);
  EXPECT_LT(between.peak_bytes, free.peak_bytes);
  EXPECT_GT(least.seconds, between.seconds);
  EXPECT_GT(between.seconds, free.seconds);
  EXPECT_EQ(memory_of_large_transfer(build, 1), 1U);
  EXPECT_EQ(memory_of_large_transfer(build, kPlenty) + 1,
            memory_of_large_transfer(build, kPlenty + 1));
  refuse_if_too_large(least, least.peak_bytes, 12);
  test::expect_error([&] { refuse_if_too_large(least, least.peak_bytes - 1, 12); },
                     "64000 patches (from 12 triangles) need about ");
}

TEST(BuildEstimate, GrowsWithEverything) {
  const LinkedBuild build{.patch_count = 30000, .link_count = 5'000'000, .matrix_count = 1};
  const auto seconds = [](const LinkedBuild& b) {
    return processor_seconds(estimate_operator_from_links(b, kPlenty));
  };
  LinkedBuild larger = build, denser = build, coloured = build, open = build;
  larger.patch_count *= 2;
  denser.link_count *= 2;
  coloured.matrix_count = 3;
  open.open = true;
  for (const LinkedBuild& other : {larger, denser, coloured, open}) {
    EXPECT_GT(seconds(other), 1.02 * seconds(build));
  }
}

}  // namespace
}  // namespace rebounce
